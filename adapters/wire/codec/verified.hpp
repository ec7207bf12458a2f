// The one door from bytes to FlatBuffers accessors, shared by the decoders of this folder.
#pragma once

#include <flatbuffers/flatbuffers.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace lbea::wire::detail {

static_assert(std::endian::native == std::endian::little, "clouds are copied as they lie in the message");

inline constexpr std::size_t flatbuffer_alignment = 8;  // of the widest scalar, counted from the buffer's begin
inline constexpr std::size_t max_flatbuffer_bytes = FLATBUFFERS_MAX_BUFFER_SIZE - 1;
inline constexpr flatbuffers::uoffset_t max_depth = 8;

/// `bytes`, or a copy of them in `scratch` when they lie at an address that is not divisible by 8: the
/// verifier checks alignment relative to the begin only, and received payloads may begin anywhere.
inline std::span<const std::byte> aligned(std::span<const std::byte> bytes, std::vector<std::uint64_t>& scratch) {
  if (bytes.empty() || std::bit_cast<std::uintptr_t>(bytes.data()) % flatbuffer_alignment == 0) return bytes;
  scratch.resize((bytes.size() + 7) / 8);
  std::memcpy(scratch.data(), bytes.data(), bytes.size());
  return std::as_bytes(std::span{scratch}).first(bytes.size());
}

inline std::string text(const flatbuffers::String* string) { return string == nullptr ? std::string() : string->str(); }

inline bool has_identifier(std::span<const std::byte> bytes, const char* identifier) noexcept {
  return bytes.size() >= 8 && std::memcmp(bytes.data() + 4, identifier, 4) == 0;
}

/// Null unless every offset reachable from the root stays inside `bytes`, which must lie at an 8-byte
/// boundary and be at most max_flatbuffer_bytes long.
template <class Root>
const Root* verified_root(std::span<const std::byte> bytes, flatbuffers::uoffset_t max_tables) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
  flatbuffers::Verifier::Options options;
  options.max_depth = max_depth;
  options.max_tables = max_tables;
  options.check_nested_flatbuffers = false;  // an inner buffer comes through this door itself, aligned
  flatbuffers::Verifier verifier(begin, bytes.size(), options);
  return verifier.VerifyBuffer<Root>(nullptr) ? flatbuffers::GetRoot<Root>(begin) : nullptr;
}

}  // namespace lbea::wire::detail
