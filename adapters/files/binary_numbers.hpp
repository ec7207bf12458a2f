// Numbers in binary files: values of either byte order, and sizes that cannot overflow.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace lbea::io::binary {
enum class Scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// Bytes.
[[nodiscard]] inline std::size_t size_of(Scalar type) noexcept {
  constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

[[nodiscard]] constexpr bool is_real(Scalar type) noexcept { return type >= Scalar::float32; }
[[nodiscard]] inline bool is_signed_integer(Scalar type) noexcept {
  return !is_real(type) && static_cast<int>(type) % 2 == 0;
}

/// An unsigned integer of `size` bytes at `at`.
[[nodiscard]] inline std::uint64_t load_bits(const std::byte* at, std::size_t size, bool is_big_endian) noexcept {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i)
    bits |= std::to_integer<std::uint64_t>(at[is_big_endian ? size - 1 - i : i]) << (8 * i);
  return bits;
}

/// A value of this type at `at`.
[[nodiscard]] inline double load(const std::byte* at, Scalar type, bool is_big_endian) noexcept {
  const std::size_t size = size_of(type);
  const std::uint64_t bits = load_bits(at, size, is_big_endian);
  if (type == Scalar::float32) return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  if (type == Scalar::float64) return std::bit_cast<double>(bits);
  if (!is_signed_integer(type)) return static_cast<double>(bits);
  const auto unused = 64 - 8 * size;  // bits above the sign
  return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
}

/// Sizes computed from numbers in a file saturate instead of wrapping round: a saturated size fits no file.
[[nodiscard]] inline std::uint64_t plus(std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<std::uint64_t>::max() : sum;
}
[[nodiscard]] inline std::uint64_t times(std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::uint64_t>::max() : product;
}
}  // namespace lbea::io::binary
