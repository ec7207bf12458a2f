#include "adapters/wire/bound/bound_socket.hpp"

namespace lbea::wire::detail {
namespace {
ZapServer& zap_server_of(WireContext::State& state) {
  const std::lock_guard lock(state.mutex);
  if (state.zap_server == nullptr) state.zap_server = std::make_shared<ZapServer>(state.context);
  return *state.zap_server;
}

/// Throws Error{endpoint_unavailable}.
void bind(zmq::socket_t& socket, const Endpoint& endpoint) {
  try {
    socket.bind(endpoint.address);
  } catch (const zmq::error_t& error) {
    const std::string what = error.num() == EADDRINUSE
                                 ? "is in use by another process; stop that one or choose another port"
                                 : std::string("cannot be opened (") + error.what() + "); choose another one";
    fail_unavailable(endpoint.address, " " + what);
  }
}
}  // namespace

BoundSocket::BoundSocket(WireContext& context, zmq::socket_type type, const SocketOptions& options,
                         const std::string& address, const ServerAccess& access)
    : where(parse_bind_endpoint(address, access)),
      lock(where),
      socket(make_socket(context.state().context, type, options)) {
  if (access.keys) {
    socket.set(zmq::sockopt::curve_server, true);
    socket.set(zmq::sockopt::curve_secretkey, access.keys->secret_key);
  }
  if (where.transport != Transport::inproc) admission = zap_server_of(context.state()).attach(socket, access);
  bind(socket, where);
  endpoint = socket.get(zmq::sockopt::last_endpoint);
  EndpointLock::restrict_to_owner(where);
}

BoundSocket::~BoundSocket() {
  zmq_unbind(socket.handle(), endpoint.c_str());
  lock.remove_socket(where);
}
}  // namespace lbea::wire::detail
