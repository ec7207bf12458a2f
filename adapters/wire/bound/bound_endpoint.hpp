// Endpoints to bind, and the lock of an ipc path. Set-up only: all functions throw Error with the endpoint in the
// sentence.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/sockets/endpoint.hpp"

namespace lbea::wire {
/// parse_endpoint for an endpoint to bind. A socket without keys accepts every peer, so it must be local to this
/// machine: throws Error{bad_config} for a tcp host that is not 127.x.y.z or localhost, unless `access` has keys and an
/// allow-list.
[[nodiscard]] Endpoint parse_bind_endpoint(const std::string& address, const ServerAccess& access = {});

/// Holds PATH.lock of an ipc endpoint. Without it a second process that binds the same path would take over the traffic
/// without an error on either side.
class EndpointLock {
 public:
  EndpointLock() = default;
  /// Throws Error{endpoint_unavailable} when another process holds it or the folder cannot be written.
  explicit EndpointLock(const Endpoint& endpoint);
  ~EndpointLock();
  EndpointLock(EndpointLock&& other) noexcept;
  EndpointLock& operator=(EndpointLock&& other) noexcept;
  /// Whether the lock file is still there: somebody may have removed it, and another process may have its own.
  [[nodiscard]] bool is_held() const noexcept;
  /// Write permission on the socket's node is permission to connect.
  static void restrict_to_owner(const Endpoint& endpoint) noexcept;
  /// ZeroMQ does not remove the node. Without the lock it is another process's, started after somebody removed both.
  void remove_socket(const Endpoint& endpoint) const noexcept;

 private:
  [[noreturn]] void release_and_throw(const Endpoint& endpoint, const std::string& why);
  std::filesystem::path file_;
  int descriptor_ = -1;
};
}  // namespace lbea::wire
