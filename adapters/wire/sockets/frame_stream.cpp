#include "adapters/wire/sockets/send_room.hpp"
#include "adapters/wire/sockets/socket.hpp"

#include <atomic>
#include <new>
#include <thread>

namespace lbea::wire {

namespace detail {
/// Taken over by the socket and still in this process.
struct InFlight {
  std::atomic<std::uint64_t> messages{0}, frames{0};
};
}  // namespace detail

namespace {

constexpr std::int64_t largest_control_message = 1024;  // what a receiver may send to a sender

/// Keeps a message alive while ZeroMQ reads it, and tells when it is done.
struct Pending {
  std::shared_ptr<const std::vector<std::byte>> message;
  std::shared_ptr<detail::InFlight> in_flight;
  bool is_frame;
  // ZeroMQ's queues order what the two threads do, but a thread sanitizer does not see into them.
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

}  // namespace

struct FrameSource::State {
  detail::BoundSocket bound;
  zmq::message_t message;
};

FrameSource::FrameSource(WireContext& context, const std::string& address, WireLimits limits,
                         const ServerAccess& access) try {
  const detail::SocketOptions options{.high_water_mark = static_cast<int>(limits.queued_messages),
                                      .max_message_bytes = static_cast<std::int64_t>(limits.max_message_bytes())};
  state_.reset(new State{{context, zmq::socket_type::pull, options, address, access}, {}});
} catch (const std::bad_alloc&) { context.state().lost_a_socket = true; }

FrameSource::~FrameSource() = default;
FrameSource::FrameSource(FrameSource&&) noexcept = default;
FrameSource& FrameSource::operator=(FrameSource&&) noexcept = default;

const std::string& FrameSource::endpoint() const noexcept { return state_->bound.endpoint; }

PeerCounts FrameSource::peers() const noexcept {
  return state_->bound.admission ? state_->bound.admission->counts() : PeerCounts{};
}

std::vector<PeerVisit> FrameSource::visits() {
  return state_->bound.admission ? state_->bound.admission->visits() : std::vector<PeerVisit>{};
}

std::optional<Message> FrameSource::receive(std::chrono::milliseconds timeout) noexcept {
  auto& [bound, message] = *state_;
  auto& socket = bound.socket;
  if (detail::receive(socket, message, ZMQ_DONTWAIT) == detail::Io::done) return detail::bytes_of(message);
  if (timeout.count() == 0 || detail::wait(socket, ZMQ_POLLIN, timeout) != detail::Io::done) return {};
  if (detail::receive(socket, message, ZMQ_DONTWAIT) != detail::Io::done) return {};
  return detail::bytes_of(message);
}

struct FrameSink::State {
  zmq::socket_t socket;
  detail::SendRoom room;
  Tally tally{};
  std::shared_ptr<detail::InFlight> in_flight = std::make_shared<detail::InFlight>();

  bool hand_over(const std::shared_ptr<const std::vector<std::byte>>& bytes, bool is_frame,
                 std::chrono::milliseconds timeout) noexcept;
};

FrameSink::FrameSink(WireContext& context, const std::string& address, std::uint32_t queued_messages,
                     const ClientAccess& access) try {
  const Endpoint endpoint = parse_endpoint(address);
  auto socket = detail::make_socket(context.state().context, zmq::socket_type::push,
                                    {.high_water_mark = static_cast<int>(queued_messages),
                                     .max_message_bytes = largest_control_message,
                                     .waits_for_connection = true});
  detail::SendRoom room(context.state().context, socket, endpoint);
  detail::connect(socket, endpoint, access);
  state_.reset(new State{std::move(socket), std::move(room)});
} catch (const std::bad_alloc&) { context.state().lost_a_socket = true; }

FrameSink::~FrameSink() = default;
FrameSink::FrameSink(FrameSink&&) noexcept = default;
FrameSink& FrameSink::operator=(FrameSink&&) noexcept = default;

const FrameSink::Tally& FrameSink::tally() const noexcept { return state_->tally; }

bool FrameSink::wait_ready(std::chrono::milliseconds timeout) noexcept {
  return detail::wait(state_->socket, ZMQ_POLLOUT, timeout) == detail::Io::done;
}

bool FrameSink::send(Message message, std::chrono::milliseconds timeout) noexcept {
  return send(std::make_shared<const std::vector<std::byte>>(message.begin(), message.end()), timeout);
}

bool FrameSink::tell(Message message, std::chrono::milliseconds timeout) noexcept {
  return state_->hand_over(std::make_shared<const std::vector<std::byte>>(message.begin(), message.end()), false,
                           timeout);
}

bool FrameSink::send(const std::shared_ptr<const std::vector<std::byte>>& bytes,
                     std::chrono::milliseconds timeout) noexcept {
  const bool sent = state_->hand_over(bytes, true, timeout);
  ++(sent ? state_->tally.sent : state_->tally.refused);
  return sent;
}

bool FrameSink::State::hand_over(const std::shared_ptr<const std::vector<std::byte>>& bytes, bool is_frame,
                                 std::chrono::milliseconds timeout) noexcept {
  room.look();
  in_flight->messages.fetch_add(1, std::memory_order_relaxed);
  if (is_frame) in_flight->frames.fetch_add(1, std::memory_order_relaxed);
  auto* pending = new Pending{bytes, in_flight, is_frame};
  pending->is_filled.store(true, std::memory_order_release);
  // ZeroMQ only reads what it sends; it takes a pointer to non-const for the release function's sake.
  zmq::message_t message(const_cast<std::byte*>(bytes->data()), bytes->size(), release, pending);
  detail::Io io = detail::send(socket, message, ZMQ_DONTWAIT);
  if (io == detail::Io::would_block && timeout.count() > 0 &&
      detail::wait(socket, ZMQ_POLLOUT, timeout) == detail::Io::done)
    io = detail::send(socket, message, ZMQ_DONTWAIT);
  return io == detail::Io::done;
}

std::uint64_t FrameSink::flush(std::chrono::milliseconds timeout) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  const auto left = [&] { return state_->in_flight->messages.load(std::memory_order_acquire); };
  while ((left() > 0 || state_->room.has_unread()) && std::chrono::steady_clock::now() < deadline) {
    // A look at the socket lets it give up what a broken connection left in it.
    static_cast<void>(detail::wait(state_->socket, ZMQ_POLLOUT, {}));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return state_->in_flight->frames.load(std::memory_order_acquire);
}

}  // namespace lbea::wire
