// Which results concern a component that a program shows.
#pragma once

#include "adapters/wire/codec/messages.hpp"

namespace lbea::tool {

/// Whether the result is by the model with this checksum, or of the whole frame: always with one model.
[[nodiscard]] inline bool concerns(const wire::WireResult& result, std::uint64_t model_checksum) noexcept {
  return result.component.empty() || result.model_checksum == model_checksum;
}

}  // namespace lbea::tool
