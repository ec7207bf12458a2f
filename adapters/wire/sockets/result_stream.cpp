#include "adapters/wire/sockets/socket.hpp"

#include <new>
#include <utility>

namespace lbea::wire {
namespace {
constexpr int result_linger_ms = 1000;
constexpr std::int64_t largest_subscription = 1024;
constexpr std::int64_t largest_result = 16 << 20;
}  // namespace

struct ResultSink::State {
  detail::BoundSocket bound;
  bool has_newcomer = false;

  /// ZeroMQ keeps what subscribers say until it is read: always read it.
  void hear_subscribers() noexcept;
};

ResultSink::ResultSink(WireContext& context, const std::string& address, int held, const ServerAccess& access) try {
  const detail::SocketOptions options{
      .high_water_mark = held, .max_message_bytes = largest_subscription, .linger_ms = result_linger_ms};
  state_.reset(new State{{context, zmq::socket_type::xpub, options, address, access}});
  state_->bound.socket.set(zmq::sockopt::xpub_verbose, true);  // every subscription, not every first one
} catch (const std::bad_alloc&) { context.state().lost_a_socket = true; }

ResultSink::~ResultSink() = default;
ResultSink::ResultSink(ResultSink&&) noexcept = default;
ResultSink& ResultSink::operator=(ResultSink&&) noexcept = default;

const std::string& ResultSink::endpoint() const noexcept { return state_->bound.endpoint; }

bool ResultSink::send(Message bytes) noexcept {
  state_->hear_subscribers();
  zmq::message_t message(bytes.data(), bytes.size());
  return detail::send(state_->bound.socket, message, ZMQ_DONTWAIT) == detail::Io::done;
}

void ResultSink::State::hear_subscribers() noexcept {
  zmq::message_t subscription;
  while (detail::receive(bound.socket, subscription, ZMQ_DONTWAIT) == detail::Io::done)
    has_newcomer |= subscription.size() > 0 && *subscription.data<char>() == 1;
}

bool ResultSink::has_newcomer() noexcept {
  state_->hear_subscribers();
  return std::exchange(state_->has_newcomer, false);
}

PeerCounts ResultSink::peers() const noexcept {
  return state_->bound.admission ? state_->bound.admission->counts() : PeerCounts{};
}

std::vector<PeerVisit> ResultSink::visits() {
  return state_->bound.admission ? state_->bound.admission->visits() : std::vector<PeerVisit>{};
}

struct ResultSource::State {
  zmq::socket_t socket;
  zmq::message_t message;
};

ResultSource::ResultSource(WireContext& context, const std::string& address, int held, const ClientAccess& access) try {
  const Endpoint endpoint = parse_endpoint(address);
  auto socket = detail::make_socket(context.state().context, zmq::socket_type::sub,
                                    {.high_water_mark = held, .max_message_bytes = largest_result});
  detail::connect(socket, endpoint, access);
  state_.reset(new State{std::move(socket), {}});
} catch (const std::bad_alloc&) { context.state().lost_a_socket = true; }

ResultSource::~ResultSource() = default;
ResultSource::ResultSource(ResultSource&&) noexcept = default;
ResultSource& ResultSource::operator=(ResultSource&&) noexcept = default;

std::optional<Message> ResultSource::receive(std::chrono::milliseconds timeout) noexcept {
  auto& [socket, message] = *state_;
  if (detail::receive(socket, message, ZMQ_DONTWAIT) == detail::Io::done) return detail::bytes_of(message);
  if (timeout.count() == 0 || detail::wait(socket, ZMQ_POLLIN, timeout) != detail::Io::done) return {};
  if (detail::receive(socket, message, ZMQ_DONTWAIT) != detail::Io::done) return {};
  return detail::bytes_of(message);
}

}  // namespace lbea::wire
