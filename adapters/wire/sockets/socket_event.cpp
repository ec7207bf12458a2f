#include "adapters/wire/sockets/socket_event.hpp"

#include <cstring>

namespace lbea::wire::detail {

// Two parts: kind and value, then the address.
EventRead read_event(zmq::socket_t& monitor, SocketEvent& event) noexcept {
  event = {};
  zmq::message_t said, address;
  if (zmq_msg_recv(said.handle(), monitor.handle(), ZMQ_DONTWAIT) < 0)
    return zmq_errno() == EAGAIN ? EventRead::none : EventRead::closed;
  zmq_msg_recv(address.handle(), monitor.handle(), ZMQ_DONTWAIT);
  if (said.size() < sizeof event.kind + sizeof event.value) return EventRead::done;
  std::memcpy(&event.kind, said.data(), sizeof event.kind);
  std::memcpy(&event.value, static_cast<const char*>(said.data()) + sizeof event.kind, sizeof event.value);
  return EventRead::done;
}

}  // namespace lbea::wire::detail
