#include "adapters/wire/sockets/socket.hpp"

namespace lbea::wire {
namespace {
constexpr int io_threads = 1;  // one carries 5 GB/s

/// ZeroMQ starts its threads with the first socket. A context that failed to start them, with an error or with
/// std::bad_alloc, blocks for ever when it is destroyed (libzmq 4.3.4). It is therefore leaked, once, by a program that
/// cannot start.
zmq::context_t started_context() {
  auto* const context = new zmq::context_t(io_threads);
  void* const first = zmq_socket(context->handle(), ZMQ_PAIR);
  if (first == nullptr) {
    const int error = zmq_errno();
    if (error == ENOMEM) throw std::bad_alloc();
    throw Error{Status::endpoint_unavailable, std::string("ZeroMQ cannot start (") + zmq_strerror(error) +
                                                  "); raise the limit of open files (ulimit -n)"};
  }
  zmq_close(first);
  const std::unique_ptr<zmq::context_t> started(context);
  return std::move(*started);
}
}  // namespace

bool has_peer_bounds() noexcept { return zmq_has("peer-bounds") != 0; }
WireContext::WireContext() : state_(std::make_unique<State>(started_context())) {}
WireContext::~WireContext() {
  [[maybe_unused]] static zmq::context_t* leaked = nullptr;
  if (state_->has_lost_socket) leaked = new zmq::context_t(std::move(state_->context));
}

namespace detail {
namespace {
// The kernel detects a peer whose machine has failed after idle + count * interval. ZeroMQ's own heartbeats are off: a
// heartbeat that is due on a connection whose peer closed while the receiver's queue was full aborts the process
// ("Assertion failed: !_io_error", libzmq 4.3.4).
constexpr int keepalive_idle_s = 5;
constexpr int keepalive_interval_s = 1;
constexpr int keepalive_count = 5;
constexpr int handshake_ms = 2000;  // then a peer that sends nothing is disconnected
constexpr int backlog = 1024;       // many unknown connections must not keep a peer from connecting
constexpr int reconnect_ms = 50;
constexpr int reconnect_max_ms = 250;  // results that a matcher publishes before are missed

Io outcome(int returned) noexcept {
  if (returned >= 0) return Io::done;
  const int error = zmq_errno();
  return error == EAGAIN || error == EINTR ? Io::would_block : Io::closed;
}
}  // namespace

zmq::socket_t make_socket(zmq::context_t& context, zmq::socket_type type, const SocketOptions& options) {
  zmq::socket_t socket(context, type);
  socket.set(zmq::sockopt::sndhwm, options.high_water_mark);
  socket.set(zmq::sockopt::rcvhwm, options.high_water_mark);
  socket.set(zmq::sockopt::linger, options.linger_ms);
  socket.set(zmq::sockopt::maxmsgsize, options.max_message_bytes);
  socket.set(zmq::sockopt::heartbeat_ivl, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, keepalive_idle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, keepalive_interval_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, keepalive_count);
  socket.set(zmq::sockopt::handshake_ivl, handshake_ms);
  socket.set(zmq::sockopt::backlog, backlog);
  socket.set(zmq::sockopt::reconnect_ivl, reconnect_ms);
  socket.set(zmq::sockopt::reconnect_ivl_max, reconnect_max_ms);
  socket.set(zmq::sockopt::immediate, options.waits_for_connection);
  if (type == zmq::socket_type::sub) socket.set(zmq::sockopt::subscribe, "");
  return socket;
}

void connect(zmq::socket_t& socket, const Endpoint& endpoint, const ClientAccess& access) {
  try {
    if (!access.server_key.empty()) {
      const CurveKeyPair keys = access.keys ? *access.keys : generate_key_pair();
      socket.set(zmq::sockopt::curve_serverkey, access.server_key);
      socket.set(zmq::sockopt::curve_publickey, keys.public_key);
      socket.set(zmq::sockopt::curve_secretkey, keys.secret_key);
    }
    socket.connect(endpoint.address);
  } catch (const zmq::error_t& error) {
    fail_unavailable(endpoint.address, std::string(" cannot be connected to (") + error.what() +
                                           "); check its spelling and that the other program runs");
  }
}

Io receive(zmq::socket_t& socket, zmq::message_t& into, int flags) noexcept {
  return outcome(zmq_msg_recv(into.handle(), socket.handle(), flags));
}

Io send(zmq::socket_t& socket, zmq::message_t& message, int flags) noexcept {
  return outcome(zmq_msg_send(message.handle(), socket.handle(), flags));
}

Io wait(zmq::socket_t& socket, short events, std::chrono::milliseconds timeout) noexcept {
  zmq_pollitem_t item{socket.handle(), 0, events, 0};
  const int ready = zmq_poll(&item, 1, static_cast<long>(timeout.count()));
  return ready == 0 ? Io::would_block : outcome(ready);
}

std::optional<Message> receive_within(std::chrono::milliseconds timeout, zmq::socket_t& socket,
                                      zmq::message_t& message) noexcept {
  if (receive(socket, message, ZMQ_DONTWAIT) == Io::done) return bytes_of(message);
  if (timeout.count() == 0 || wait(socket, ZMQ_POLLIN, timeout) != Io::done) return {};
  if (receive(socket, message, ZMQ_DONTWAIT) != Io::done) return {};
  return bytes_of(message);
}
}  // namespace detail
}  // namespace lbea::wire
