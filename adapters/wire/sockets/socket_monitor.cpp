#include "adapters/wire/sockets/socket_monitor.hpp"

#include "adapters/wire/sockets/ipc_connection.hpp"

#include <atomic>
#include <cstring>

namespace lbea::wire::detail {
namespace {
constexpr int watched_events = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_CLOSED | ZMQ_EVENT_DISCONNECTED |
                               ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
}  // namespace

zmq::socket_t monitor(zmq::context_t& context, zmq::socket_t& socket, const std::string& address, int events) {
  zmq_socket_monitor(socket.handle(), address.c_str(), events);
  zmq::socket_t monitor(context, zmq::socket_type::pair);
  monitor.set(zmq::sockopt::linger, 0);
  monitor.set(zmq::sockopt::rcvhwm, 0);  // bounded by the connections; a full queue would block ZeroMQ's I/O thread
  monitor.connect(address);
  return monitor;
}

// Two parts: kind and value, then the address.
EventRead read_event(zmq::socket_t& monitor, SocketEvent& event) noexcept {
  event = {};
  zmq::message_t content;
  if (zmq_msg_recv(content.handle(), monitor.handle(), ZMQ_DONTWAIT) < 0)
    return zmq_errno() == EAGAIN ? EventRead::none : EventRead::closed;
  zmq_msg_recv(event.address.handle(), monitor.handle(), ZMQ_DONTWAIT);
  if (content.size() < sizeof event.kind + sizeof event.value) return EventRead::done;
  std::memcpy(&event.kind, content.data(), sizeof event.kind);
  std::memcpy(&event.value, static_cast<const char*>(content.data()) + sizeof event.kind, sizeof event.value);
  return EventRead::done;
}

ConnectionWatch::ConnectionWatch(zmq::context_t& context, zmq::socket_t& socket, const Endpoint& endpoint)
    : path_(endpoint.path.string()), socket_(socket.handle()) {
  static std::atomic<unsigned> next = 0;
  if (endpoint.transport == Transport::inproc) return;
  monitor_ = monitor(context, socket, "inproc://lbea.connection." + std::to_string(next++), watched_events);
}

// ZeroMQ's I/O thread would block for ever in an event that nobody can read any more.
ConnectionWatch::~ConnectionWatch() {
  if (monitor_.handle() != nullptr) zmq_socket_monitor(socket_, nullptr, 0);
}

void ConnectionWatch::poll() noexcept {
  if (monitor_.handle() == nullptr) return;
  for (SocketEvent event; read_event(monitor_, event) == EventRead::done;) on_event(event);
}

void ConnectionWatch::on_event(const SocketEvent& event) noexcept {
  switch (event.kind) {
    case ZMQ_EVENT_CONNECTED:
      if (!path_.empty() && enlarge_send_buffer(event.value, path_, wanted_bytes)) connection_ = event.value;
      return;
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      link_ = Link::admitted;
      return;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
      link_ = Link::refused;
      return;
    case ZMQ_EVENT_CLOSED:  // the attempt to connect failed
      if (link_ != Link::refused) link_ = Link::absent;
      return;
    case ZMQ_EVENT_DISCONNECTED:  // also after a failed handshake
      if (link_ == Link::admitted) link_ = Link::absent;
      return;
    default:
      link_ = Link::unusable;
  }
}

bool ConnectionWatch::has_unread() const noexcept { return connection_ >= 0 && has_unread_bytes(connection_, path_); }
}  // namespace lbea::wire::detail
