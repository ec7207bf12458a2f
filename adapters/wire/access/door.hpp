// One bound socket's rules about who comes in, and its counts of who did. Only the .cpp files of this folder include
// it.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/sockets/streams.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <zmq.h>

namespace lbea::wire::detail {

/// Counts are written by the gate's thread and read by any.
class Door {
 public:
  /// What note() wants to hear of a socket's monitor.
  static constexpr int watched = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED |
                                 ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                 ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_MONITOR_STOPPED;
  static constexpr const char* refused = "400";  // such a peer does not try again

  Door(std::string domain, const ServerAccess& access);

  [[nodiscard]] const std::string& domain() const noexcept { return domain_; }
  [[nodiscard]] PeerCounts counts() const noexcept;
  [[nodiscard]] std::vector<PeerVisit> visits();
  /// Gate's thread. The status code of RFC 27. `key`: 32 bytes, or none.
  [[nodiscard]] const char* answer(std::string_view mechanism, std::string_view key, std::string_view address) noexcept;
  /// Gate's thread. An event of the socket's monitor.
  void note(std::uint16_t event, std::int32_t value);

 private:
  using Clock = std::chrono::steady_clock;
  using Count = std::atomic<std::uint64_t>;
  void note_end(std::int32_t descriptor);
  void note_visit(PeerVisit::Answer answer, std::string_view name, std::string_view address) noexcept;

  std::string domain_;
  bool wants_keys_;
  std::map<std::string, std::string, std::less<>> names_;  // by public key, 32 bytes each
  std::uint64_t max_peers_;
  std::map<std::int32_t, Clock::time_point> connections_;  // by descriptor: since when
  std::uint64_t put_off_ = 0;                              // told to come back, and not gone yet
  bool failed_last_ = false;  // the event before was a handshake that failed; its end follows at once
  std::mutex visits_mutex_;
  std::vector<PeerVisit> visits_;  // the first since somebody asked
  Count open_{0}, peers_{0}, admitted_{0}, unknown_{0}, excess_{0}, malformed_{0};
};

}  // namespace lbea::wire::detail
