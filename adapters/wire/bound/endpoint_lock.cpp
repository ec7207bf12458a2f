#include "adapters/wire/bound/bound_endpoint.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace lbea::wire {
namespace {
/// Whether `descriptor` is still the file `name`; its last holder may have removed that meanwhile.
bool is_same_file(int descriptor, const std::filesystem::path& name) {
  struct stat mine;
  struct stat named;
  return fstat(descriptor, &mine) == 0 && stat(name.c_str(), &named) == 0 && mine.st_ino == named.st_ino &&
         mine.st_dev == named.st_dev;
}

/// A socket that a killed process left behind refuses connections.
bool has_listener(const std::filesystem::path& path) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
  const bool listens =
      ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 || errno == EAGAIN;
  ::close(socket);
  return listens;
}

int open_lock_file(const Endpoint& endpoint, const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor >= 0) return descriptor;
  fail_unavailable(endpoint.address, ": cannot open the lock file " + file.string() + " (" + std::strerror(errno) +
                                         "); choose a path in a folder you may write to");
}
}  // namespace

EndpointLock::EndpointLock(const Endpoint& endpoint) {
  if (endpoint.transport != Transport::ipc) return;
  file_ = endpoint.path.string() + ".lock";
  while (true) {
    descriptor_ = open_lock_file(endpoint, file_);
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      ::close(std::exchange(descriptor_, -1));
      fail_unavailable(endpoint.address, " is in use by another process (it holds " + file_.string() +
                                             "); stop that one or choose another path");
    }
    if (is_same_file(descriptor_, file_)) break;
    ::close(std::exchange(descriptor_, -1));
  }
  // ZeroMQ unlinks any file at the path, also one that is not a socket.
  struct stat found;
  if (::stat(endpoint.path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode))
    release_and_throw(endpoint, ": " + endpoint.path.string() + " exists and is not a socket; choose another path");
  if (has_listener(endpoint.path))
    release_and_throw(
        endpoint,
        " is in use by another process, whose lock file somebody removed; stop that one or choose another path");
}

void EndpointLock::release_and_throw(const Endpoint& endpoint, const std::string& why) {
  ::unlink(file_.c_str());
  ::close(std::exchange(descriptor_, -1));
  fail_unavailable(endpoint.address, why);
}

bool EndpointLock::is_held() const noexcept { return descriptor_ >= 0 && is_same_file(descriptor_, file_); }

EndpointLock::~EndpointLock() {
  if (descriptor_ < 0) return;
  if (is_held()) ::unlink(file_.c_str());
  ::close(descriptor_);
}

EndpointLock::EndpointLock(EndpointLock&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

EndpointLock& EndpointLock::operator=(EndpointLock&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

void EndpointLock::restrict_to_owner(const Endpoint& endpoint) noexcept {
  if (endpoint.transport == Transport::ipc) ::chmod(endpoint.path.c_str(), 0600);
}

void EndpointLock::remove_socket(const Endpoint& endpoint) const noexcept {
  if (endpoint.transport == Transport::ipc && is_held()) ::unlink(endpoint.path.c_str());
}
}  // namespace lbea::wire
