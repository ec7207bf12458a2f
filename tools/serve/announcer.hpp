// Results for captures that never reach the matcher. Counts what it can give none.
#pragma once

#include "tools/serve/handover.hpp"
#include "tools/serve/rate_limit.hpp"

namespace lbea::tool {

/// The receiving thread's.
class Announcer {
 public:
  Announcer(double strays_per_second, Handover& handover) : stray_limit_(strays_per_second), handover_(handover) {}
  /// A message that is refused, counted here.
  void refuse(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept;
  /// Captures of which no frame came, counted elsewhere.
  void announce(wire::WireStatus status, std::uint64_t session, IdRange ids, std::int64_t receive_ns) noexcept;

 private:
  void announce(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept;

  RateLimit stray_limit_;  // of messages that are nobody's frame
  Handover& handover_;
};

}  // namespace lbea::tool
