// Log lines about the peers of a bound socket.
#pragma once

#include "adapters/wire/sockets/streams.hpp"

#include <chrono>
#include <functional>

namespace lbea::tool {

/// Logs admitted and disconnected peers and the number of refused connections, at most once a second.
class PeerLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// `endpoint`: its name in the log. `visits` and `counts`: the socket's functions visits() and peers().
  PeerLog(const char* endpoint, std::function<std::vector<wire::PeerVisit>()> visits,
          std::function<wire::PeerCounts()> counts)
      : endpoint_(endpoint), visits_(std::move(visits)), counts_(std::move(counts)) {}
  /// Call often.
  void poll(Clock::time_point now);

 private:
  const char* endpoint_;
  std::function<std::vector<wire::PeerVisit>()> visits_;
  std::function<wire::PeerCounts()> counts_;
  Clock::time_point next_{};
  wire::PeerCounts logged_;
};

/// Warns when the program is built with a libzmq that does not survive every peer.
void warn_of_unbounded_peers();

}  // namespace lbea::tool
