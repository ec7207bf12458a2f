#include "tools/shared/system/service_notify.hpp"

#include <cstddef>
#include <cstdlib>
#include <cstring>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

std::string taken_from_environment(const char* name) {
  const char* value = std::getenv(name);
  const std::string text = value == nullptr ? "" : value;
  ::unsetenv(name);
  return text;
}

/// A datagram socket connected to `path`; a leading @ means the abstract namespace. -1 on failure.
int connected(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return -1;
  std::memcpy(address.sun_path, path.data(), path.size());
  if (path[0] == '@') address.sun_path[0] = '\0';
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket >= 0 && ::connect(socket, reinterpret_cast<const sockaddr*>(&address), length) == 0) return socket;
  if (socket >= 0) ::close(socket);
  return -1;
}

}  // namespace

ServiceNotify::ServiceNotify() : socket_(connected(taken_from_environment("NOTIFY_SOCKET"))) {
  for (const char* name : {"WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
}

ServiceNotify::~ServiceNotify() {
  if (socket_ >= 0) ::close(socket_);
}

void ServiceNotify::ready(const std::string& status) const noexcept { tell("READY=1\nSTATUS=" + status); }
void ServiceNotify::status(const std::string& status) const noexcept { tell("STATUS=" + status); }
void ServiceNotify::alive() const noexcept { tell("WATCHDOG=1"); }
void ServiceNotify::stopping() const noexcept { tell("STOPPING=1"); }

void ServiceNotify::tell(const std::string& text) const noexcept {
  if (socket_ >= 0) static_cast<void>(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL));
}

}  // namespace lbea::tool
