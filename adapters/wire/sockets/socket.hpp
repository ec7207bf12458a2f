// Set-up of ZeroMQ: the context, the options of every socket, and its errors as sentences. Only the .cpp files of this
// library include it.
#pragma once

#include "adapters/wire/sockets/endpoint.hpp"
#include "adapters/wire/sockets/streams.hpp"

#include <mutex>

#include <zmq.hpp>

namespace lbea::wire {
namespace detail {
class ZapServer;
}

struct WireContext::State {
  explicit State(zmq::context_t&& started) : context(std::move(started)) {}
  zmq::context_t context;
  std::mutex mutex;                               // of the next one
  std::shared_ptr<detail::ZapServer> zap_server;  // from the first bound socket on
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
void connect(zmq::socket_t& socket, const Endpoint& endpoint, const ClientAccess& access);

enum class Io { done, would_block, closed };
/// These do not throw; a signal counts as would_block.
Io receive(zmq::socket_t& socket, zmq::message_t& into, int flags) noexcept;
Io send(zmq::socket_t& socket, zmq::message_t& message, int flags) noexcept;
/// Waits for `events` (ZMQ_POLLIN, ZMQ_POLLOUT), at most for `timeout`.
Io wait(zmq::socket_t& socket, short events, std::chrono::milliseconds timeout) noexcept;

/// The next message, in `message`; nothing when none arrives within `timeout`.
std::optional<Message> receive_within(std::chrono::milliseconds timeout, zmq::socket_t& socket,
                                      zmq::message_t& message) noexcept;

inline std::span<const std::byte> bytes_of(const zmq::message_t& message) noexcept {
  return {static_cast<const std::byte*>(message.data()), message.size()};
}
}  // namespace detail
}  // namespace lbea::wire
