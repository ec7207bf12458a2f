// Room for whole frames in the connection of an ipc socket that sends.
#pragma once

#include "adapters/wire/sockets/endpoint.hpp"

#include <zmq.hpp>

namespace lbea::wire::detail {

/// ZeroMQ leaves the buffers of ipc connections as the system makes them: 208 kB, less than a third of a frame. Both
/// sides then take turns several times per frame, and on a busy machine every turn waits for a processor. This asks the
/// system for more, as far as it grants that (net.core.wmem_max).
class SendRoom {
 public:
  static constexpr int wanted_bytes = 4 << 20;

  /// Before the socket connects.
  SendRoom(zmq::context_t& context, zmq::socket_t& socket, const Endpoint& endpoint);
  /// Takes care of connections made since the last look: the first, and those after the receiver was started anew.
  void look() noexcept;
  /// Whether the receiver has yet to read something. ZeroMQ throws it away when the sender leaves while the receiver's
  /// queue is full.
  [[nodiscard]] bool has_unread() const noexcept;

 private:
  std::string path_;
  int connection_ = -1;
  zmq::socket_t monitor_;
};

}  // namespace lbea::wire::detail
