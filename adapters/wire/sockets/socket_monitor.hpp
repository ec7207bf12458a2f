// ZeroMQ's socket monitors, and what one tells about the connection of a connecting socket.
#pragma once

#include "adapters/wire/sockets/endpoint.hpp"
#include "adapters/wire/sockets/streams.hpp"

#include <cstdint>

#include <zmq.hpp>

namespace lbea::wire::detail {
struct SocketEvent {
  std::uint16_t kind = 0;  // ZMQ_EVENT_...
  std::int32_t value = 0;  // depends on the kind: a file descriptor, an error number, ...
  zmq::message_t address;  // of the socket, or of the peer
};

enum class EventRead { done, none, closed };

/// Monitors `events` of a socket; `address`: a new inproc:// address. Returns the PAIR socket to read them from.
[[nodiscard]] zmq::socket_t monitor(zmq::context_t& context, zmq::socket_t& socket, const std::string& address,
                                    int events);
/// Reads one event without waiting.
[[nodiscard]] EventRead read_event(zmq::socket_t& monitor, SocketEvent& event) noexcept;

/// The connection of a connecting socket: how the other end answered, and the kernel's send buffer over ipc. ZeroMQ
/// keeps the system's default of 208 kB, less than a third of a frame. Sender and receiver then alternate several times
/// per frame, and on a busy machine each time waits for a processor. This class requests a larger buffer, which the
/// system grants up to net.core.wmem_max.
class ConnectionWatch {
 public:
  static constexpr int wanted_bytes = 4 << 20;

  /// Call before the socket connects. The socket must live longer; it may be moved.
  ConnectionWatch(zmq::context_t& context, zmq::socket_t& socket, const Endpoint& endpoint);
  ~ConnectionWatch();
  ConnectionWatch(ConnectionWatch&&) noexcept = default;
  /// Reads what has happened since the last call, and enlarges the buffers of new connections: the first one, and those
  /// after a restart of the receiver.
  void poll() noexcept;
  /// As of the last poll().
  [[nodiscard]] Link link() const noexcept { return link_; }
  /// Whether the receiver has yet to read something. ZeroMQ discards it when the sender closes while the receiver's
  /// queue is full.
  [[nodiscard]] bool has_unread() const noexcept;

 private:
  void on_event(const SocketEvent& event) noexcept;

  std::string path_;  // of ipc
  int connection_ = -1;
  Link link_ = Link::absent;
  void* socket_;
  zmq::socket_t monitor_;
};
}  // namespace lbea::wire::detail
