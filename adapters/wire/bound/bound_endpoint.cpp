#include "adapters/wire/bound/bound_endpoint.hpp"

#include "adapters/wire/bound/addresses.hpp"

namespace lbea::wire {
Endpoint parse_bind_endpoint(const std::string& address, const ServerAccess& access) {
  check_access(access);
  Endpoint endpoint = parse_endpoint(address);
  if (endpoint.transport != Transport::tcp) return endpoint;
  const auto [host, port] = host_and_port(address);
  if (host == "localhost") {
    endpoint.address = "tcp://127.0.0.1:" + port;
  } else if (!detail::is_loopback(host) && !access.keys) {
    refuse_endpoint(address, "without keys only this machine may connect; use 127.0.0.1 instead of " + host +
                                 ", or give a secret key and the public keys of those who may (--key, --allow)");
  }
  return endpoint;
}
}  // namespace lbea::wire
