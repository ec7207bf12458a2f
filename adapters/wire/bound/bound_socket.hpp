// A bound socket: its endpoint, lock and admission rules.
#pragma once

#include "adapters/wire/bound/bound_endpoint.hpp"
#include "adapters/wire/bound/zap_server.hpp"
#include "adapters/wire/sockets/socket.hpp"

namespace lbea::wire::detail {
/// A bound socket and the objects that must outlive it.
struct BoundSocket {
  BoundSocket(WireContext& context, zmq::socket_type type, const SocketOptions& options, const std::string& address,
              const ServerAccess& access);
  ~BoundSocket();
  BoundSocket(const BoundSocket&) = delete;
  BoundSocket& operator=(const BoundSocket&) = delete;
  [[nodiscard]] PeerCounts peers() const noexcept { return admission ? admission->counts() : PeerCounts{}; }
  [[nodiscard]] std::vector<PeerVisit> visits() { return admission ? admission->visits() : std::vector<PeerVisit>{}; }
  Endpoint where;
  EndpointLock lock;
  zmq::socket_t socket;
  std::shared_ptr<PeerAdmission> admission;  // not for inproc
  std::string endpoint;                      // as bound
};
}  // namespace lbea::wire::detail
