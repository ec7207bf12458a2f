#include "tools/shared/text/outlet.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

constexpr auto retry_interval = std::chrono::milliseconds(20);

mode_t type_of(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 ? about.st_mode & S_IFMT : 0;
}

/// A terminal or pipe is opened anew, because O_NONBLOCK belongs to all descriptors of one open file.
int reopened(int descriptor) {
  const mode_t type = type_of(descriptor);
  if (type == S_IFCHR || type == S_IFIFO) {
    const std::string name = "/proc/self/fd/" + std::to_string(descriptor);
    const int own = ::open(name.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (own >= 0) return own;  // otherwise the reader is gone, or the terminal belongs to another user
  }
  return ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
}

}  // namespace

class Outlet::Stream {
 public:
  explicit Stream(int descriptor) : is_socket_(type_of(descriptor) == S_IFSOCK), descriptor_(reopened(descriptor)) {}
  ~Stream() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  [[nodiscard]] ssize_t write_some(std::string_view text) const noexcept {
    if (is_socket_) return ::send(descriptor_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    pollfd room{descriptor_, POLLOUT, 0};
    if (::poll(&room, 1, 0) == 0) return errno = EAGAIN, -1;
    return ::write(descriptor_, text.data(), text.size());
  }

 private:
  bool is_socket_;
  int descriptor_;
};

Outlet::Outlet(int descriptor) : stream_(std::make_shared<Stream>(descriptor)) {}
Outlet::~Outlet() = default;

bool Outlet::write(std::string_view text, const std::function<bool()>& gives_up) const {
  while (!text.empty()) {
    const ssize_t written = stream_->write_some(text);
    if (written < 0 && errno != EAGAIN && errno != EINTR) return false;
    text.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
    if (written >= 0) continue;
    if (gives_up()) return errno = EAGAIN, false;
    std::this_thread::sleep_for(retry_interval);
  }
  return true;
}

}  // namespace lbea::tool
