#include "adapters/wire/sockets/client.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <random>
#include <thread>

namespace lbea::wire {
namespace {
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto heartbeat_interval = 200ms;
constexpr auto max_flush = 2000ms;
constexpr std::chrono::milliseconds look_interval = 50ms;  // between looks at the answer of the other end

void block_signals() {  // the program's own threads handle them
#ifndef _WIN32
  sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_BLOCK, &all, nullptr);
#endif
}
}  // namespace

std::uint64_t new_session() {
  std::random_device random;
  return (std::uint64_t{random()} << 32) | random();
}

struct FrameSender::State {
  State(FrameSink* connected, std::uint64_t number) : sink(*connected), session(number) {}
  State(FrameSink&& connected, std::uint64_t number) : owned(std::move(connected)), sink(*owned), session(number) {}

  /// Greets the receiver and begins the heartbeats.
  void start();
  void keep_alive();
  /// False without room or memory.
  bool report(ControlKind kind, std::chrono::milliseconds timeout) noexcept;
  /// Counts a capture, and sends it with `send_frame` after what was withheld before is reported: ids arrive in order.
  template <class Send>
  bool capture(std::chrono::milliseconds timeout, Send&& send_frame);

  std::optional<FrameSink> owned;
  FrameSink& sink;
  const std::uint64_t session;
  std::uint64_t next_id = 0;
  std::uint64_t withheld = 0;  // of the ids just below next_id, not yet reported
  SendTally tally;
  Encoder frames, controls;
  bool has_ended = false, is_finished = false;
  Clock::time_point last_message;
  std::mutex mutex;  // of all of the above, between the caller's thread and the heartbeats'
  std::condition_variable finished;
  std::thread heartbeats;
};

void FrameSender::State::start() {
  report(ControlKind::hello, max_flush);
  heartbeats = std::thread(&State::keep_alive, this);
}

void FrameSender::State::keep_alive() {
  block_signals();
  std::unique_lock lock(mutex);
  while (!finished.wait_for(lock, heartbeat_interval, [&] { return is_finished; }))
    if (!has_ended && Clock::now() - last_message >= heartbeat_interval) report(ControlKind::heartbeat, 0ms);
}

bool FrameSender::State::report(ControlKind kind, std::chrono::milliseconds timeout) noexcept try {
  last_message = Clock::now();
  const bool sent = sink.tell(controls.control({session, kind, next_id, withheld}), timeout);
  if (sent) withheld = 0;
  return sent;
} catch (const std::bad_alloc&) { return false; }

template <class Send>
bool FrameSender::State::capture(std::chrono::milliseconds timeout, Send&& send_frame) {
  const bool sent = (withheld == 0 || report(ControlKind::heartbeat, timeout)) && send_frame();
  last_message = Clock::now();
  has_ended = false;
  ++next_id;
  ++(sent ? tally.sent : tally.refused);
  if (!sent) ++withheld;
  return sent;
}

bool wait_admitted(FrameSink& sink, std::chrono::milliseconds patience) noexcept {
  const auto deadline = Clock::now() + patience;
  while (!sink.wait_ready(std::min(patience, look_interval)))
    if (sink.link() == Link::refused || Clock::now() >= deadline) return false;
  return true;
}

FrameSender::FrameSender(WireContext& context, const std::string& endpoint, const ClientAccess& access,
                         std::chrono::milliseconds patience) {
  FrameSink sink(context, endpoint, default_queued_messages, access);
  if (!wait_admitted(sink, patience))
    throw Error(Status::endpoint_unavailable, explain(sink.link(), endpoint, "--frames"));
  state_ = std::make_unique<State>(std::move(sink), new_session());
  state_->start();
}

FrameSender::FrameSender(FrameSink& sink, std::uint64_t session) : state_(std::make_unique<State>(&sink, session)) {
  state_->start();
}

FrameSender::~FrameSender() {
  if (state_) finish();
}
FrameSender::FrameSender(FrameSender&&) noexcept = default;
std::uint64_t FrameSender::session() const noexcept { return state_->session; }
std::uint64_t FrameSender::next_id() const noexcept { return state_->next_id; }

bool FrameSender::send(std::span<const Point> points, std::int64_t stamp_ns, std::chrono::milliseconds timeout) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  const auto encoded = s.frames.frame({s.next_id, stamp_ns, points}, s.session);
  const auto frame = std::make_shared<const std::vector<std::byte>>(encoded.begin(), encoded.end());
  return s.capture(timeout, [&] { return !frame->empty() && s.sink.send(frame, timeout); });
}

bool FrameSender::send(const std::shared_ptr<const std::vector<std::byte>>& frame, std::chrono::milliseconds timeout) {
  const std::lock_guard lock(state_->mutex);
  return state_->capture(timeout, [&] { return frame != nullptr && state_->sink.send(frame, timeout); });
}

Link FrameSender::link() {
  const std::lock_guard lock(state_->mutex);
  return state_->sink.link();
}

SendTally FrameSender::tally() const {
  const std::lock_guard lock(state_->mutex);
  SendTally tally = state_->tally;
  tally.captured = state_->next_id;
  return tally;
}

bool FrameSender::wait_ready(std::chrono::milliseconds timeout) {
  const std::lock_guard lock(state_->mutex);
  return state_->sink.wait_ready(timeout);
}

bool FrameSender::end_stream() {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  if (s.withheld > 0 && !s.report(ControlKind::heartbeat, max_flush)) return false;
  s.has_ended = s.sink.tell(s.controls.end_of_stream(s.session, s.next_id), max_flush);
  return s.has_ended;
}

SendTally FrameSender::finish() {
  State& s = *state_;
  {
    const std::lock_guard lock(s.mutex);
    if (s.is_finished) return s.tally;
    if (!s.has_ended) s.report(ControlKind::goodbye, max_flush);
    s.is_finished = true;
  }
  s.finished.notify_one();
  s.heartbeats.join();
  s.tally.captured = s.next_id;
  s.tally.handed_over = s.tally.sent - std::min(s.tally.sent, s.sink.flush(max_flush));
  return s.tally;
}

const WireResult* ResultReceiver::receive(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (auto left = timeout;;) {
    const auto message = source_.receive(left);
    if (!message) return nullptr;
    if (read(*message)) return &result_;
    left = std::max(0ms, std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()));
  }
}

/// Whether it is a result.
bool ResultReceiver::read(Message message) {
  if (decode_result(message, result_) == WireStatus::ok) {
    count(result_.sequence);
    ends_with_state_ = false;
    return true;
  }
  if (WireState state; decode_state(message, state) == WireStatus::ok) {
    count(state.sequence);
    // A gap between the sequences of two matchers is no loss.
    if (!state_ || state_->start_ns == state.start_ns) lost_ += lost_since_state_;
    lost_since_state_ = 0;
    ends_with_state_ = true;
    state_ = std::move(state);
  } else {
    ++damaged_;
  }
  return false;
}

// A restarted matcher counts from 0.
void ResultReceiver::count(std::uint64_t sequence) {
  if (next_sequence_ && sequence > *next_sequence_) lost_since_state_ += sequence - *next_sequence_;
  next_sequence_ = sequence + 1;
}
}  // namespace lbea::wire
