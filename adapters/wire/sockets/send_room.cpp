#include "adapters/wire/sockets/send_room.hpp"

#include "adapters/wire/sockets/socket_event.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>

namespace lbea::wire::detail {
namespace {

// By the time its number is read the connection may be gone, and the number another file's.
bool leads_to(int connection, const std::string& path) noexcept {
  sockaddr_un peer{};
  socklen_t size = sizeof(peer);
  return getpeername(connection, reinterpret_cast<sockaddr*>(&peer), &size) == 0 && peer.sun_family == AF_UNIX &&
         path == peer.sun_path;
}

}  // namespace

SendRoom::SendRoom(zmq::context_t& context, zmq::socket_t& socket, const Endpoint& endpoint) : path_(endpoint.path) {
  static std::atomic<unsigned> next = 0;
  if (endpoint.transport != Transport::ipc) return;
  const std::string address = "inproc://lbea.send-room." + std::to_string(next++);
  zmq_socket_monitor(socket.handle(), address.c_str(), ZMQ_EVENT_CONNECTED);
  monitor_ = zmq::socket_t(context, zmq::socket_type::pair);
  monitor_.set(zmq::sockopt::linger, 0);
  monitor_.set(zmq::sockopt::rcvhwm, 0);  // one message per connection; a full queue would stop ZeroMQ's I/O thread
  monitor_.connect(address);
}

void SendRoom::look() noexcept {
  if (monitor_.handle() == nullptr) return;
  for (SocketEvent event; read_event(monitor_, event) == EventRead::done;)
    if (event.kind == ZMQ_EVENT_CONNECTED && leads_to(event.value, path_)) {
      connection_ = event.value;
      setsockopt(connection_, SOL_SOCKET, SO_SNDBUF, &wanted_bytes, sizeof(wanted_bytes));
    }
}

bool SendRoom::has_unread() const noexcept {
  int bytes = 0;
  return connection_ >= 0 && leads_to(connection_, path_) && ioctl(connection_, SIOCOUTQ, &bytes) == 0 && bytes > 0;
}

}  // namespace lbea::wire::detail
