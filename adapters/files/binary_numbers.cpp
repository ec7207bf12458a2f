#include "adapters/files/binary_numbers.hpp"

#include <array>
#include <bit>

namespace lbea::io::binary {

std::size_t size_of(Scalar type) noexcept {
  constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

bool is_signed_integer(Scalar type) noexcept { return !is_real(type) && static_cast<int>(type) % 2 == 0; }

std::uint64_t load_bits(const std::byte* at, std::size_t size, bool is_big_endian) noexcept {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i)
    bits |= std::to_integer<std::uint64_t>(at[is_big_endian ? size - 1 - i : i]) << (8 * i);
  return bits;
}

double load(const std::byte* at, Scalar type, bool is_big_endian) noexcept {
  const std::size_t size = size_of(type);
  const std::uint64_t bits = load_bits(at, size, is_big_endian);
  if (type == Scalar::float32) return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  if (type == Scalar::float64) return std::bit_cast<double>(bits);
  if (!is_signed_integer(type)) return static_cast<double>(bits);
  const auto unused = 64 - 8 * size;  // bits above the sign
  return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
}

}  // namespace lbea::io::binary
