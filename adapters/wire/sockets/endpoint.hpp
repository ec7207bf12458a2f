// Endpoint addresses and the lock of an ipc path. Set-up only: all functions throw Error with the endpoint in the
// sentence.
#pragma once

#include "adapters/wire/access/keys.hpp"

#include <filesystem>
#include <string>

namespace lbea::wire {
enum class Transport { ipc, tcp, inproc };

struct Endpoint {
  Transport transport = Transport::ipc;
  std::string address;         // as given, for example "tcp://127.0.0.1:5555"
  std::filesystem::path path;  // ipc only
};

/// Throws Error{bad_config} for anything that is not ipc://PATH, tcp://HOST:PORT or inproc://NAME.
[[nodiscard]] Endpoint parse_endpoint(const std::string& address);
/// The same for an endpoint to bind. A socket without keys accepts every peer, so it must be local to this machine:
/// throws Error{bad_config} for a tcp host that is not 127.x.y.z or localhost, unless `access` has keys and an
/// allow-list.
[[nodiscard]] Endpoint parse_bind_endpoint(const std::string& address, const ServerAccess& access = {});

/// Throws Error{endpoint_unavailable} 'endpoint "ADDRESS"WHAT'.
[[noreturn]] void fail_unavailable(const std::string& address, const std::string& what);

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

 private:
  [[noreturn]] void release_and_throw(const Endpoint& endpoint, const std::string& why);
  std::filesystem::path file_;
  int descriptor_ = -1;
};
}  // namespace lbea::wire
