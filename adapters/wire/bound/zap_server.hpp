// Access control of bound sockets: a server for ZeroMQ's authentication protocol (ZAP, RFC 27) and the admission rules
// and counts of each socket. Only the .cpp files of this library include it.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/sockets/socket_monitor.hpp"
#include "adapters/wire/sockets/streams.hpp"

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include <zmq.hpp>

namespace lbea::wire::detail {
/// The admission rules of one bound socket, and the counts of its peers. The ZapServer's thread writes the counts, any
/// thread may read them.
class PeerAdmission {
 public:
  static constexpr int peer_dropped = 0x8000;  // see third_party/zmq/4-dropped-peers.patch
  /// The events of a socket's monitor that on_event() needs.
  static constexpr int watched_events = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED |
                                        ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                        ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_DISCONNECTED |
                                        ZMQ_EVENT_ACCEPT_FAILED | ZMQ_EVENT_MONITOR_STOPPED | peer_dropped;
  static constexpr const char* refused = "400";  // such a peer does not try again

  explicit PeerAdmission(const ServerAccess& access);

  [[nodiscard]] PeerCounts counts() const noexcept;
  [[nodiscard]] std::vector<PeerVisit> visits();
  /// ZapServer's thread. Returns the status code of RFC 27. `key`: 32 bytes, or none.
  [[nodiscard]] const char* admit(std::string_view mechanism, std::string_view key, std::string_view address) noexcept;
  /// ZapServer's thread. An event of the socket's monitor.
  void on_event(const SocketEvent& event);

 private:
  using Clock = std::chrono::steady_clock;
  using Count = std::atomic<std::uint64_t>;
  void on_disconnect(std::int32_t descriptor);
  void on_offense(int error, std::string_view address) noexcept;
  void add_visit(PeerVisit::Answer answer, std::string_view name, std::string_view address,
                 const char* offense = "") noexcept;
  /// With several allowed keys, none of them may hold more than half of the places.
  [[nodiscard]] bool holds_its_share(std::string_view key) const;
  void note_key(std::string_view key, std::string_view address);

  bool needs_keys_;
  std::map<std::string, std::string, std::less<>> names_;  // by public key, 32 bytes each
  std::uint64_t max_peers_;
  std::map<std::int32_t, Clock::time_point> connections_;  // by descriptor: time of accept
  std::map<std::int32_t, std::string> keys_;               // of the admitted ones among them
  std::uint64_t deferred_ = 0;                             // told to retry later, still connected
  std::uint16_t last_event_ = 0;  // a disconnect follows a failed handshake or a dropped peer at once
  std::map<std::string, std::string, std::less<>> owners_;  // by address: the last admitted key's
  std::mutex visits_mutex_;
  std::vector<PeerVisit> visits_;  // the first ones since the last call of visits()
  Count open_{0}, peers_{0}, admitted_{0}, unknown_{0}, excess_{0}, malformed_{0}, crowded_{0}, offending_{0};
};

/// Answers ZeroMQ's question for every new connection to a bound socket, in its own thread, and follows the connections
/// with the sockets' monitors.
class ZapServer {
 public:
  explicit ZapServer(zmq::context_t& context);
  ~ZapServer();
  ZapServer(const ZapServer&) = delete;
  ZapServer& operator=(const ZapServer&) = delete;
  /// Applies `access` to a socket, which must be bound afterwards.
  [[nodiscard]] std::shared_ptr<PeerAdmission> attach(zmq::socket_t& socket, const ServerAccess& access);

 private:
  struct Watch {
    zmq::socket_t monitor;
    std::shared_ptr<PeerAdmission> admission;
  };
  void wake();
  void run() noexcept;
  void poll_once();
  void wait(std::span<zmq_pollitem_t> items) noexcept;
  void answer_request() noexcept;
  /// False once the socket is gone.
  static bool read_events(Watch& watch);

  zmq::context_t& context_;
  zmq::socket_t requests_, wake_sender_, wake_receiver_;
  std::mutex mutex_;  // guards the members up to next_, and wake_sender_
  std::vector<Watch> new_watches_;
  std::map<std::string, std::weak_ptr<PeerAdmission>, std::less<>> admissions_;  // by ZAP domain
  std::uint64_t next_ = 0;
  std::atomic<bool> stopping_{false};
  std::vector<Watch> watches_;  // the thread's
  std::thread thread_;
};
}  // namespace lbea::wire::detail
