// Where sockets may live. Set-up only: everything here throws Error with the endpoint in the sentence.
#pragma once

#include "adapters/wire/access/keys.hpp"

#include <filesystem>
#include <string>

namespace lbea::wire {

enum class Transport { ipc, tcp, inproc };

struct Endpoint {
  Transport transport = Transport::ipc;
  std::string address;         // as given, e.g. "tcp://127.0.0.1:5555"
  std::filesystem::path path;  // ipc only
};

/// Throws Error{bad_config} for anything that is not ipc://PATH, tcp://HOST:PORT or inproc://NAME.
[[nodiscard]] Endpoint parse_endpoint(const std::string& address);
/// The same for an endpoint to bind. Without keys anyone who reaches a socket is believed, so only this machine
/// may: throws Error{bad_config} for a tcp host that is not 127.x.y.z or localhost, unless `access` has keys and
/// says who is allowed.
[[nodiscard]] Endpoint parse_bind_endpoint(const std::string& address, const ServerAccess& access = {});

/// Holds PATH.lock of an ipc endpoint. A second process that binds the same path would otherwise take the
/// traffic away without an error on either side.
class EndpointLock {
 public:
  EndpointLock() = default;
  /// Throws Error{endpoint_unavailable} when another process holds it or the folder cannot be written.
  explicit EndpointLock(const Endpoint& endpoint);
  ~EndpointLock();
  EndpointLock(EndpointLock&& other) noexcept;
  EndpointLock& operator=(EndpointLock&& other) noexcept;

 private:
  [[noreturn]] void give_back(const Endpoint& endpoint, const std::string& why);
  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace lbea::wire
