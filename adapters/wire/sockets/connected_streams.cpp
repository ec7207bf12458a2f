#include "adapters/wire/sockets/streams.hpp"

#include "adapters/wire/sockets/socket.hpp"
#include "adapters/wire/sockets/socket_monitor.hpp"

#include <atomic>
#include <new>
#include <thread>

namespace lbea::wire {
namespace detail {
/// What the socket has accepted and still holds in this process.
struct InFlight {
  std::atomic<std::uint64_t> messages{0}, frames{0};
};
}  // namespace detail

namespace {
constexpr std::int64_t control_socket_limit = 1024;  // of a message from a receiver to a sender
constexpr std::int64_t result_socket_limit = 16 << 20;

/// Keeps a message alive until ZeroMQ has read it.
struct Pending {
  std::shared_ptr<const std::vector<std::byte>> message;
  std::shared_ptr<detail::InFlight> in_flight;
  bool is_frame;
  // ZeroMQ's queues order the two threads' accesses, but a thread sanitizer cannot see that.
  std::atomic<bool> is_filled{false};
};

/// Called from ZeroMQ's I/O thread.
void release(void*, void* hint) {
  const std::unique_ptr<Pending> pending(static_cast<Pending*>(hint));
  static_cast<void>(pending->is_filled.load(std::memory_order_acquire));
  pending->message.reset();
  if (pending->is_frame) pending->in_flight->frames.fetch_sub(1, std::memory_order_release);
  pending->in_flight->messages.fetch_sub(1, std::memory_order_release);
}

/// Makes a message of the bytes of `pending`, which it then owns. False when there is no memory.
bool hold(zmq::message_t& message, std::unique_ptr<Pending>& pending) noexcept {
  Pending& p = *pending;
  p.is_filled.store(true, std::memory_order_release);
  // ZeroMQ only reads the bytes; its parameter is non-const because of the release function.
  if (zmq_msg_init_data(message.handle(), const_cast<std::byte*>(p.message->data()), p.message->size(), release, &p) !=
      0) {
    zmq_msg_init(message.handle());
    return false;
  }
  p.in_flight->messages.fetch_add(1, std::memory_order_relaxed);
  if (p.is_frame) p.in_flight->frames.fetch_add(1, std::memory_order_relaxed);
  static_cast<void>(pending.release());
  return true;
}

/// Null when there is no memory.
std::shared_ptr<const std::vector<std::byte>> copy_of(Message message) noexcept try {
  return std::make_shared<const std::vector<std::byte>>(message.begin(), message.end());
} catch (const std::bad_alloc&) { return nullptr; }
}  // namespace

std::string explain(Link link, const std::string& endpoint, const char* option) {
  const std::string named = "endpoint \"" + endpoint + "\": ";
  switch (link) {
    case Link::absent:
      return named + "nobody listens there; start lbea-serve with " + option + " " + endpoint;
    case Link::admitted:
      return named + "the matcher is connected and does not answer; look at its log";
    case Link::refused:
      return named + "the matcher does not allow this program's key; start lbea-serve with --allow and its public key";
    case Link::unusable:
      break;
  }
  return named +
         "the handshake failed; give both ends keys or neither, give this end the matcher's own public key, or raise "
         "--max-peers";
}

struct FrameSink::State {
  zmq::socket_t socket;
  detail::ConnectionWatch connection;
  Tally tally{};
  std::shared_ptr<detail::InFlight> in_flight = std::make_shared<detail::InFlight>();

  bool enqueue(const std::shared_ptr<const std::vector<std::byte>>& bytes, bool is_frame,
               std::chrono::milliseconds timeout) noexcept;
};

FrameSink::FrameSink(WireContext& context, const std::string& address, std::uint32_t queued_messages,
                     const ClientAccess& access) try {
  const Endpoint endpoint = parse_endpoint(address);
  auto socket = detail::make_socket(context.state().context, zmq::socket_type::push,
                                    {.high_water_mark = static_cast<int>(queued_messages),
                                     .max_message_bytes = control_socket_limit,
                                     .waits_for_connection = true});
  detail::ConnectionWatch connection(context.state().context, socket, endpoint);
  detail::connect(socket, endpoint, access);
  state_.reset(new State{std::move(socket), std::move(connection)});
} catch (const std::bad_alloc&) { context.state().has_lost_socket = true; }
FrameSink::~FrameSink() = default;
FrameSink::FrameSink(FrameSink&&) noexcept = default;
FrameSink& FrameSink::operator=(FrameSink&&) noexcept = default;
const FrameSink::Tally& FrameSink::tally() const noexcept { return state_->tally; }

bool FrameSink::wait_ready(std::chrono::milliseconds timeout) noexcept {
  return detail::wait(state_->socket, ZMQ_POLLOUT, timeout) == detail::Io::done;
}

Link FrameSink::link() noexcept {
  state_->connection.poll();
  return state_->connection.link();
}

bool FrameSink::send(Message message, std::chrono::milliseconds timeout) noexcept {
  return send(copy_of(message), timeout);
}

bool FrameSink::tell(Message message, std::chrono::milliseconds timeout) noexcept {
  return state_->enqueue(copy_of(message), false, timeout);
}

bool FrameSink::send(const std::shared_ptr<const std::vector<std::byte>>& bytes,
                     std::chrono::milliseconds timeout) noexcept {
  const bool sent = state_->enqueue(bytes, true, timeout);
  ++(sent ? state_->tally.sent : state_->tally.refused);
  return sent;
}

bool FrameSink::State::enqueue(const std::shared_ptr<const std::vector<std::byte>>& bytes, bool is_frame,
                               std::chrono::milliseconds timeout) noexcept {
  connection.poll();
  std::unique_ptr<Pending> pending(bytes ? new (std::nothrow) Pending{bytes, in_flight, is_frame} : nullptr);
  if (pending == nullptr) return false;
  zmq::message_t message;
  if (!hold(message, pending)) return false;
  detail::Io io = detail::send(socket, message, ZMQ_DONTWAIT);
  if (io == detail::Io::would_block && timeout.count() > 0 &&
      detail::wait(socket, ZMQ_POLLOUT, timeout) == detail::Io::done)
    io = detail::send(socket, message, ZMQ_DONTWAIT);
  return io == detail::Io::done;
}

std::uint64_t FrameSink::flush(std::chrono::milliseconds timeout) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  const auto left = [&] { return state_->in_flight->messages.load(std::memory_order_acquire); };
  while ((left() > 0 || state_->connection.has_unread()) && std::chrono::steady_clock::now() < deadline) {
    // Polling makes the socket discard what a broken connection left in it.
    static_cast<void>(detail::wait(state_->socket, ZMQ_POLLOUT, {}));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return state_->in_flight->frames.load(std::memory_order_acquire);
}

struct ResultSource::State {
  zmq::socket_t socket;
  detail::ConnectionWatch connection;
  zmq::message_t message;
};

ResultSource::ResultSource(WireContext& context, const std::string& address, int held, const ClientAccess& access) try {
  const Endpoint endpoint = parse_endpoint(address);
  auto socket = detail::make_socket(context.state().context, zmq::socket_type::sub,
                                    {.high_water_mark = held, .max_message_bytes = result_socket_limit});
  detail::ConnectionWatch connection(context.state().context, socket, endpoint);
  detail::connect(socket, endpoint, access);
  state_.reset(new State{std::move(socket), std::move(connection), {}});
} catch (const std::bad_alloc&) { context.state().has_lost_socket = true; }
ResultSource::~ResultSource() = default;
ResultSource::ResultSource(ResultSource&&) noexcept = default;
ResultSource& ResultSource::operator=(ResultSource&&) noexcept = default;

Link ResultSource::link() noexcept {
  state_->connection.poll();
  return state_->connection.link();
}

std::optional<Message> ResultSource::receive(std::chrono::milliseconds timeout) noexcept {
  state_->connection.poll();
  return detail::receive_within(timeout, state_->socket, state_->message);
}
}  // namespace lbea::wire
