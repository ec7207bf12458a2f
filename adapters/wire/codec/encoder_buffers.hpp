// What an Encoder keeps from message to message.
#pragma once

#include "adapters/wire/codec/codec.hpp"

#include <flatbuffers/flatbuffers.h>

namespace lbea::wire {

struct Encoder::Buffers {
  flatbuffers::FlatBufferBuilder cloud;  // the inner buffer of a frame
  flatbuffers::FlatBufferBuilder message;
};

namespace detail {
inline std::span<const std::byte> finished(const flatbuffers::FlatBufferBuilder& builder) {
  return std::as_bytes(std::span{builder.GetBufferPointer(), builder.GetSize()});
}
}  // namespace detail

}  // namespace lbea::wire
