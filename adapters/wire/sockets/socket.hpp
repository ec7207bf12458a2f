// Set-up of ZeroMQ: the context, the options of every socket, and its errors as sentences. Only the .cpp files of this
// library include it.
#pragma once

#include "adapters/wire/access/zap_server.hpp"
#include "adapters/wire/sockets/endpoint.hpp"
#include "adapters/wire/sockets/streams.hpp"

#include <zmq.hpp>

namespace lbea::wire {
struct WireContext::State {
  explicit State(zmq::context_t&& started) : context(std::move(started)) {}
  zmq::context_t context;
  detail::ZapServer zap_server{context};
  bool has_lost_socket = false;  // memory ran out during its construction: ZeroMQ would wait for it for ever
};

namespace detail {
struct SocketOptions {
  int high_water_mark = 16;            // messages held per peer and direction
  std::int64_t max_message_bytes = 0;  // larger ones are not delivered and their sender is disconnected
  int linger_ms = 0;                   // how long close() continues to send
  bool waits_for_connection = false;   // queue messages only for a connected peer (IMMEDIATE)
};

/// A socket with all options set whose default is unsafe. Most options have no effect after bind or connect.
zmq::socket_t make_socket(zmq::context_t& context, zmq::socket_type type, const SocketOptions& options);

/// Throws Error{endpoint_unavailable}.
void bind(zmq::socket_t& socket, const Endpoint& endpoint);
void connect(zmq::socket_t& socket, const Endpoint& endpoint, const ClientAccess& access);

/// A bound socket and the objects that must outlive it.
struct BoundSocket {
  BoundSocket(WireContext& context, zmq::socket_type type, const SocketOptions& options, const std::string& address,
              const ServerAccess& access);
  ~BoundSocket();
  BoundSocket(const BoundSocket&) = delete;
  BoundSocket& operator=(const BoundSocket&) = delete;
  [[nodiscard]] PeerCounts peers() const noexcept { return admission ? admission->counts() : PeerCounts{}; }
  [[nodiscard]] std::vector<PeerVisit> visits() { return admission ? admission->visits() : std::vector<PeerVisit>{}; }
  Endpoint where;
  EndpointLock lock;
  zmq::socket_t socket;
  std::shared_ptr<PeerAdmission> admission;  // not for inproc
  std::string endpoint;                      // as bound
};

enum class Io { done, would_block, closed };
/// These do not throw; a signal counts as would_block.
Io receive(zmq::socket_t& socket, zmq::message_t& into, int flags) noexcept;
Io send(zmq::socket_t& socket, zmq::message_t& message, int flags) noexcept;
/// Waits for `events` (ZMQ_POLLIN, ZMQ_POLLOUT), at most for `timeout`.
Io wait(zmq::socket_t& socket, short events, std::chrono::milliseconds timeout) noexcept;

inline std::span<const std::byte> bytes_of(const zmq::message_t& message) noexcept {
  return {static_cast<const std::byte*>(message.data()), message.size()};
}
}  // namespace detail
}  // namespace lbea::wire
