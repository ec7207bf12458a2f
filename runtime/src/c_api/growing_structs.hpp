// Structs of the C interfaces that may grow: an older caller passes a smaller one than the library knows, a newer
// caller a larger one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace lbea {
inline constexpr std::string_view size_not_set =
    "struct_size is not the size of the struct; set it to sizeof, or call the init function";

// A struct_size that was never set is usually larger than any struct will ever be.
inline constexpr std::uint32_t largest_c_struct = 4'096;

/// `least` is the struct's size in the first version that had it.
inline bool is_plausible_size(std::uint32_t struct_size, std::size_t least) noexcept {
  return struct_size >= least && struct_size <= largest_c_struct;
}

/// Writes the fields of `full` that the caller knows, and zeros into those that this library does not know.
template <typename T>
void write_c_struct(const T& full, T* out) noexcept {
  const std::uint32_t size = out->struct_size;
  const std::size_t shared = std::min<std::size_t>(size, sizeof(T));
  auto* bytes = reinterpret_cast<unsigned char*>(out);
  std::memcpy(bytes, &full, shared);
  std::memset(bytes + shared, 0, size - shared);
  out->struct_size = size;
}

/// Reads the fields that the caller set into `full`, which holds the defaults. False when the caller set a field that
/// this library does not know.
template <typename T>
bool read_c_struct(const T* in, T& full) noexcept {
  const std::size_t shared = std::min<std::size_t>(in->struct_size, sizeof(T));
  const auto* bytes = reinterpret_cast<const unsigned char*>(in);
  std::memcpy(&full, bytes, shared);
  return std::all_of(bytes + shared, bytes + in->struct_size, [](unsigned char byte) { return byte == 0; });
}
}  // namespace lbea
