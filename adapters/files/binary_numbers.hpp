// Numbers in binary files: values of either byte order, and sizes that cannot overflow.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace lbea::io::binary {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

[[nodiscard]] std::size_t size_of(Scalar type) noexcept;  // bytes
[[nodiscard]] constexpr bool is_real(Scalar type) noexcept { return type >= Scalar::float32; }
[[nodiscard]] bool is_signed_integer(Scalar type) noexcept;

/// An unsigned integer of `size` bytes at `at`.
[[nodiscard]] std::uint64_t load_bits(const std::byte* at, std::size_t size, bool is_big_endian) noexcept;
/// A value of this type at `at`.
[[nodiscard]] double load(const std::byte* at, Scalar type, bool is_big_endian) noexcept;

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
