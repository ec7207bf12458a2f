// Who comes in: answers ZeroMQ's question for every new connection to a bound socket (ZAP), in a thread of its own,
// and watches what becomes of the connections. Only the .cpp files of this folder include it.
#pragma once

#include "adapters/wire/keys.hpp"
#include "adapters/wire/streams.hpp"

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>

#include <zmq.hpp>

namespace lbea::detail {

/// One bound socket's rules and counts. Counts are written by the gate's thread and read by any.
class Door {
 public:
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
  std::uint64_t put_off_ = 0;  // told to come back, and not gone yet
  bool failed_last_ = false;  // the event before was a handshake that failed; its end follows at once
  std::mutex visits_mutex_;
  std::vector<PeerVisit> visits_;  // the first since somebody asked
  Count open_{0}, peers_{0}, admitted_{0}, unknown_{0}, excess_{0}, malformed_{0};
};

class Gate {
 public:
  explicit Gate(zmq::context_t& context);
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;
  /// Puts a door before a socket, which is to be bound afterwards.
  [[nodiscard]] std::shared_ptr<Door> guard(zmq::socket_t& socket, const ServerAccess& access);

 private:
  struct Watch {
    zmq::socket_t monitor;
    std::shared_ptr<Door> door;
  };
  void wake();
  void run() noexcept;
  void turn();
  void wait(std::span<zmq_pollitem_t> items) noexcept;
  void answer() noexcept;
  /// False once the socket is gone.
  static bool hear(Watch& watch);

  zmq::context_t& context_;
  zmq::socket_t questions_, bell_, ear_;
  std::mutex mutex_;  // guards what follows, and bell_
  std::vector<Watch> arrivals_;
  std::map<std::string, std::weak_ptr<Door>, std::less<>> doors_;
  std::uint64_t next_ = 0;
  std::atomic<bool> stopping_{false};
  std::vector<Watch> watches_;  // the thread's
  std::thread thread_;
};

}  // namespace lbea::detail
