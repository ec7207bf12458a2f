// ZeroMQ's socket monitors, and the kernel's send buffer of ipc connections, which is set through one.
#pragma once

#include "adapters/wire/sockets/endpoint.hpp"

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

/// The kernel's send buffer of a sending ipc socket. ZeroMQ keeps the system's default of 208 kB, less than a third of
/// a frame. Sender and receiver then alternate several times per frame, and on a busy machine each time waits for a
/// processor. This class requests a larger buffer, which the system grants up to net.core.wmem_max.
class SendBuffer {
 public:
  static constexpr int wanted_bytes = 4 << 20;

  /// Call before the socket connects.
  SendBuffer(zmq::context_t& context, zmq::socket_t& socket, const Endpoint& endpoint);
  /// Enlarges the buffers of connections made since the last call: the first one, and those after a restart of the
  /// receiver.
  void poll() noexcept;
  /// Whether the receiver has yet to read something. ZeroMQ discards it when the sender closes while the receiver's
  /// queue is full.
  [[nodiscard]] bool has_unread() const noexcept;

 private:
  std::string path_;
  int connection_ = -1;
  zmq::socket_t monitor_;
};
}  // namespace lbea::wire::detail
