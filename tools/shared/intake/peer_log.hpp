// Log lines about the peers of a bound socket.
#pragma once

#include "adapters/wire/sockets/streams.hpp"

#include <chrono>

namespace lbea::tool {

/// Logs admitted and disconnected peers and the number of refused connections, at most once a second.
class PeerLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// `endpoint`: its name in the log.
  explicit PeerLog(const char* endpoint) : endpoint_(endpoint) {}
  /// Call often. `visits` and `counts` are those of the socket.
  template <class Visits, class Counts>
  void poll(Clock::time_point now, const Visits& visits, const Counts& counts) {
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    log(visits(), counts());
  }

 private:
  void log(const std::vector<wire::PeerVisit>& visits, const wire::PeerCounts& counts);

  const char* endpoint_;
  Clock::time_point next_{};
  wire::PeerCounts logged_;
};

/// Warns when the program is built with a libzmq that does not survive every peer.
void warn_of_unbounded_peers();

}  // namespace lbea::tool
