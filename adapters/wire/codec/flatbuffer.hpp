// FlatBuffers helpers of the codecs: verified access to received bytes, and the Encoder's builders. Private to this
// folder.
#pragma once

#include "adapters/wire/codec/codec.hpp"

#include <flatbuffers/flatbuffers.h>

#include <bit>
#include <cstring>

namespace lbea::wire {
struct Encoder::Buffers {
  flatbuffers::FlatBufferBuilder cloud;  // the inner buffer of a frame
  flatbuffers::FlatBufferBuilder message;
  flatbuffers::FlatBufferBuilder& cleared() {
    message.Clear();
    return message;
  }
};

namespace detail {
static_assert(std::endian::native == std::endian::little, "points are copied from the message as they are");

inline constexpr std::size_t flatbuffer_alignment = 8;  // of the widest scalar, relative to the buffer's begin
inline constexpr std::size_t max_flatbuffer_bytes = FLATBUFFERS_MAX_BUFFER_SIZE - 1;
inline constexpr flatbuffers::uoffset_t max_depth = 8;

inline std::span<const std::byte> finished(const flatbuffers::FlatBufferBuilder& builder) {
  return std::as_bytes(std::span{builder.GetBufferPointer(), builder.GetSize()});
}

/// `bytes`, or a copy of them in `scratch` when their address is not divisible by 8: the verifier checks alignment
/// relative to the begin only, and received payloads may begin at any address.
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

/// Null unless every offset reachable from the root stays inside `bytes`, which must begin at an 8-byte boundary and be
/// at most max_flatbuffer_bytes long.
template <class Root>
const Root* verified_root(std::span<const std::byte> bytes, flatbuffers::uoffset_t max_tables) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
  flatbuffers::Verifier::Options options;
  options.max_depth = max_depth;
  options.max_tables = max_tables;
  options.check_nested_flatbuffers = false;  // a nested buffer is verified by its own call, after alignment
  flatbuffers::Verifier verifier(begin, bytes.size(), options);
  return verifier.VerifyBuffer<Root>(nullptr) ? flatbuffers::GetRoot<Root>(begin) : nullptr;
}

struct MessageLimits {
  std::size_t bytes;
  flatbuffers::uoffset_t tables;
};

/// The verified root of a message; null and the reason when it is not one. `scratch`: see aligned().
template <class Root>
std::pair<const Root*, WireStatus> open(std::span<const std::byte> message, const char* identifier,
                                        const MessageLimits& limits, std::vector<std::uint64_t>& scratch) {
  if (message.size() > limits.bytes) return {nullptr, WireStatus::message_too_large};
  if (!has_identifier(message, identifier)) return {nullptr, WireStatus::wrong_kind};
  const auto* root = verified_root<Root>(aligned(message, scratch), limits.tables);
  return {root, root == nullptr ? WireStatus::damaged : WireStatus::ok};
}
}  // namespace detail
}  // namespace lbea::wire
