#include "adapters/wire/sockets/ipc_connection.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>

namespace lbea::wire::detail {
namespace {
bool leads_to(int connection, const std::string& path) noexcept {
  sockaddr_un peer{};
  socklen_t size = sizeof(peer);
  return getpeername(connection, reinterpret_cast<sockaddr*>(&peer), &size) == 0 && peer.sun_family == AF_UNIX &&
         path == peer.sun_path;
}
}  // namespace

bool enlarge_send_buffer(int connection, const std::string& path, int wanted_bytes) noexcept {
  if (!leads_to(connection, path)) return false;
  setsockopt(connection, SOL_SOCKET, SO_SNDBUF, &wanted_bytes, sizeof(wanted_bytes));
  return true;
}

bool has_unread_bytes(int connection, const std::string& path) noexcept {
  int bytes = 0;
  return leads_to(connection, path) && ioctl(connection, SIOCOUTQ, &bytes) == 0 && bytes > 0;
}
}  // namespace lbea::wire::detail
