// ZeroMQ kept in one place: the context, every option of every socket, and errors in words.
// Only the .cpp files of this folder include it.
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
  bool lost_a_socket = false;  // half made when memory ran out: ZeroMQ would wait for it for ever
};

namespace detail {

struct SocketOptions {
  int high_water_mark = 16;            // messages held per peer and direction
  std::int64_t max_message_bytes = 0;  // larger ones are not delivered and their sender is disconnected
  int linger_ms = 0;                   // how long close() goes on sending
  bool waits_for_connection = false;   // sends queue only once a peer is there (IMMEDIATE)
};

/// A socket with everything set that has an unsafe default. Before bind or connect: most options do nothing
/// later.
zmq::socket_t make_socket(zmq::context_t& context, zmq::socket_type type, const SocketOptions& options);

/// Throws Error{endpoint_unavailable}.
void bind(zmq::socket_t& socket, const Endpoint& endpoint);
void connect(zmq::socket_t& socket, const Endpoint& endpoint, const ClientAccess& access);

/// A bound socket and what has to outlive it.
struct BoundSocket {
  BoundSocket(WireContext& context, zmq::socket_type type, const SocketOptions& options, const std::string& address,
              const ServerAccess& access);
  ~BoundSocket();
  BoundSocket(const BoundSocket&) = delete;
  BoundSocket& operator=(const BoundSocket&) = delete;
  Endpoint where;
  EndpointLock lock;
  zmq::socket_t socket;
  std::shared_ptr<PeerAdmission> admission;  // not for inproc
  std::string endpoint;                      // as bound
};

enum class Io { done, would_block, closed };
/// Without exceptions; a signal counts as would_block.
Io receive(zmq::socket_t& socket, zmq::message_t& into, int flags) noexcept;
Io send(zmq::socket_t& socket, zmq::message_t& message, int flags) noexcept;
/// Waits until `events` (ZMQ_POLLIN, ZMQ_POLLOUT) or for `timeout`.
Io wait(zmq::socket_t& socket, short events, std::chrono::milliseconds timeout) noexcept;

inline std::span<const std::byte> bytes_of(const zmq::message_t& message) noexcept {
  return {static_cast<const std::byte*>(message.data()), message.size()};
}

}  // namespace detail

}  // namespace lbea::wire
