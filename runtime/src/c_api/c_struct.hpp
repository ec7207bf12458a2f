// Structs of the C interface that may grow: old callers hand in less than this library knows, newer ones more.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace lbea {

// A struct_size nobody set is most often larger than any struct will ever be.
inline constexpr std::uint32_t largest_c_struct = 4'096;

/// `least` is the struct's size in the first version that had it.
inline bool is_plausible_size(std::uint32_t struct_size, std::size_t least) noexcept {
  return struct_size >= least && struct_size <= largest_c_struct;
}

/// Writes what the caller knows of `full`, and zeros into what this library does not know.
template <typename T>
void write_c_struct(const T& full, T* out) noexcept {
  const std::uint32_t size = out->struct_size;
  const std::size_t shared = std::min<std::size_t>(size, sizeof(T));
  auto* bytes = reinterpret_cast<unsigned char*>(out);
  std::memcpy(bytes, &full, shared);
  std::memset(bytes + shared, 0, size - shared);
  out->struct_size = size;
}

/// Reads what the caller set into `full`, which holds the defaults; false when it set what this library does not know.
template <typename T>
bool read_c_struct(const T* in, T& full) noexcept {
  const std::size_t shared = std::min<std::size_t>(in->struct_size, sizeof(T));
  const auto* bytes = reinterpret_cast<const unsigned char*>(in);
  std::memcpy(&full, bytes, shared);
  return std::all_of(bytes + shared, bytes + in->struct_size, [](unsigned char byte) { return byte == 0; });
}

}  // namespace lbea
