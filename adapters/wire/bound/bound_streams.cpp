#include "adapters/wire/bound/bound_socket.hpp"

#include <algorithm>
#include <array>
#include <new>

namespace lbea::wire {
namespace {
constexpr int result_linger_ms = 1000;
constexpr std::int64_t max_subscription_bytes = 1024;
}  // namespace

PeerCounts& PeerCounts::operator+=(const PeerCounts& more) noexcept {
  connections += more.connections;
  peers += more.peers;
  admitted += more.admitted;
  unknown += more.unknown;
  excess += more.excess;
  malformed += more.malformed;
  crowded += more.crowded;
  offending += more.offending;
  return *this;
}

struct FrameSource::State {
  detail::BoundSocket bound;
  zmq::message_t message;
};

FrameSource::FrameSource(WireContext& context, const std::string& address, WireLimits limits,
                         const ServerAccess& access) try {
  const detail::SocketOptions options{.high_water_mark = static_cast<int>(limits.queued_messages),
                                      .max_message_bytes = static_cast<std::int64_t>(limits.max_message_bytes())};
  state_.reset(new State{{context, zmq::socket_type::pull, options, address, access}, {}});
} catch (const std::bad_alloc&) { context.state().has_lost_socket = true; }
FrameSource::~FrameSource() = default;
FrameSource::FrameSource(FrameSource&&) noexcept = default;
FrameSource& FrameSource::operator=(FrameSource&&) noexcept = default;
const std::string& FrameSource::endpoint() const noexcept { return state_->bound.endpoint; }
PeerCounts FrameSource::peers() const noexcept { return state_->bound.peers(); }
std::vector<PeerVisit> FrameSource::visits() { return state_->bound.visits(); }

std::optional<Message> FrameSource::receive(std::chrono::milliseconds timeout) noexcept {
  return detail::receive_within(timeout, state_->bound.socket, state_->message);
}

void wait_for_any(std::span<const FrameSource* const> sources, std::chrono::milliseconds timeout) noexcept {
  constexpr std::size_t most = 64;
  std::array<zmq_pollitem_t, most> items{};
  const std::size_t count = std::min(sources.size(), most);
  for (std::size_t i = 0; i < count; ++i) items[i] = {sources[i]->state_->bound.socket.handle(), 0, ZMQ_POLLIN, 0};
  static_cast<void>(zmq_poll(items.data(), static_cast<int>(count), static_cast<long>(timeout.count())));
}

struct ResultSink::State {
  detail::BoundSocket bound;
  bool has_newcomer = false;

  /// ZeroMQ queues subscriptions until they are read.
  void read_subscriptions() noexcept;
};

ResultSink::ResultSink(WireContext& context, const std::string& address, int held, const ServerAccess& access) try {
  const detail::SocketOptions options{
      .high_water_mark = held, .max_message_bytes = max_subscription_bytes, .linger_ms = result_linger_ms};
  state_.reset(new State{{context, zmq::socket_type::xpub, options, address, access}});
  state_->bound.socket.set(zmq::sockopt::xpub_verbose,
                           true);  // report every subscription, not only the first to a topic
} catch (const std::bad_alloc&) { context.state().has_lost_socket = true; }
ResultSink::~ResultSink() = default;
ResultSink::ResultSink(ResultSink&&) noexcept = default;
ResultSink& ResultSink::operator=(ResultSink&&) noexcept = default;
const std::string& ResultSink::endpoint() const noexcept { return state_->bound.endpoint; }

bool ResultSink::send(Message bytes) noexcept {
  state_->read_subscriptions();
  zmq::message_t message(bytes.data(), bytes.size());
  return detail::send(state_->bound.socket, message, ZMQ_DONTWAIT) == detail::Io::done;
}

void ResultSink::State::read_subscriptions() noexcept {
  zmq::message_t subscription;
  while (detail::receive(bound.socket, subscription, ZMQ_DONTWAIT) == detail::Io::done)
    has_newcomer |= subscription.size() > 0 && *subscription.data<char>() == 1;
}

bool ResultSink::has_newcomer() noexcept {
  state_->read_subscriptions();
  return std::exchange(state_->has_newcomer, false);
}

PeerCounts ResultSink::peers() const noexcept { return state_->bound.peers(); }
std::vector<PeerVisit> ResultSink::visits() { return state_->bound.visits(); }
}  // namespace lbea::wire
