// Which frames' quantities of interest are not shown as if they were measured.
#pragma once

#include "adapters/wire/codec/messages.hpp"

namespace lbea::tool {

/// A result without a match, or with one that the frame does not support: no simulation fits, or it shows too little.
[[nodiscard]] inline bool is_doubtful(const wire::WireResult& result) noexcept {
  using wire::WireVerdict;
  return wire::fate_of(result.status) != wire::Fate::matched || result.status == wire::WireStatus::low_coverage ||
         result.verdict == WireVerdict::low_coverage || result.verdict == WireVerdict::refused ||
         result.verdict == WireVerdict::no_simulation_fits;
}

}  // namespace lbea::tool
