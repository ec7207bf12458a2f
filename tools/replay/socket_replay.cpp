#include "tools/replay/socket_replay.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include <poll.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto stop_interval = 50ms;  // longest delay of a stop
constexpr auto ready_interval = 50ms;
constexpr auto longest_flush = 2000ms;
constexpr auto longest_silence = 5000ms;
constexpr std::int64_t longest_disorder_ns = 1'000'000'000, long_pause_ns = 10'000'000'000;

/// Round 0 keeps the recorded session; each other round has a new one.
std::uint64_t session_of(std::uint64_t recorded, std::uint64_t round) {
  return recorded ^ (round * 0x9e37'79b9'7f4a'7c15);
}

/// Sends the rounds and counts.
class Sender {
 public:
  Sender(const SocketReplayConfig& config, wire::FrameSink& sink, Pace& pace, const std::function<bool()>& stop)
      : config_(config), sink_(sink), pace_(pace), stop_(stop) {}

  void send_round(RecordedRun& run, std::uint64_t round) {
    while (const auto message = run.next()) {
      if (message->kind != RecordedMessage::Kind::frame) continue;
      if (!pace_.wait_for(message->log_time_ns)) return;
      while (config_.waits && !stop_() && !sink_.wait_ready(ready_interval)) {}
      if (stop_()) return;
      send(*message, session_of(message->session, round));
    }
  }
  void say_goodbye(MatcherReceipts* receipts) {
    for (const auto& [session, next_id] : next_ids_) {
      if (config_.ends_stream) sink_.tell(encoder_.end_of_stream(session, next_id), longest_flush);
      if (receipts != nullptr) receipts->ask(sink_, session, next_id);
    }
  }
  [[nodiscard]] std::uint64_t repeated() const noexcept { return ids_.duplicates(); }

 private:
  void send(const RecordedMessage& frame, std::uint64_t session) {
    std::uint64_t& next_id = next_ids_[session];
    next_id = std::max(next_id, frame.id + 1);
    if (sink_.send(encoder_.frame_of_cloud(frame.data, session, frame.id)))
      static_cast<void>(ids_.observe(session, frame.id));
  }
  const SocketReplayConfig& config_;
  wire::FrameSink& sink_;
  Pace& pace_;
  const std::function<bool()>& stop_;
  wire::Encoder encoder_;
  IdTracker ids_;
  std::map<std::uint64_t, std::uint64_t> next_ids_;  // of each session, for the goodbye
};

}  // namespace

bool Pace::wait_for(std::int64_t log_time_ns) {
  if (config_.steps) return wait_for_line();
  if (config_.speed == 0) return !stop_();
  // Older recordings may contain a step of the clock: backwards, the pace starts anew.
  if (!begun_ || log_time_ns < last_ns_ - longest_disorder_ns) {
    begun_ = true;
    begin_ = Clock::now();
    first_ns_ = log_time_ns;
  } else if (log_time_ns > last_ns_ + long_pause_ns) {
    spdlog::info("no frame for {:.0f} s of the recording; --fast does not wait",
                 1e-9 * static_cast<double>(log_time_ns - last_ns_));
  }
  last_ns_ = log_time_ns;
  const double offset_ns = static_cast<double>(log_time_ns - first_ns_) / config_.speed;
  const auto due = begin_ + std::chrono::nanoseconds(static_cast<std::int64_t>(offset_ns));
  while (!stop_() && Clock::now() < due) std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
  worst_ = std::max(worst_, std::chrono::nanoseconds(Clock::now() - due));
  return !stop_();
}

bool Pace::wait_for_line() const {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!stop_()) {
    if (::poll(&input, 1, static_cast<int>(stop_interval.count())) <= 0) continue;
    char letter = 0;
    do {
      if (::read(STDIN_FILENO, &letter, 1) != 1) return false;
    } while (letter != '\n');
    return true;
  }
  return false;
}

MatcherReceipts::MatcherReceipts(wire::WireContext& context, const std::string& results_endpoint,
                                 const wire::ClientAccess& access, const std::function<bool()>& stop)
    : context_(context), endpoint_(results_endpoint), access_(access) {
  wire::ResultSource source = results();
  auto state = wait_for_state(
      source, [&, deadline = Clock::now() + longest_silence] { return stop() || Clock::now() >= deadline; });
  if (!state)
    throw Error(Status::endpoint_unavailable,
                "endpoint \"" + endpoint_ +
                    "\": no matcher publishes results there; give the endpoint of lbea-serve --results");
  receipts_.emplace(std::move(*state));
}

void MatcherReceipts::ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id) {
  Handshake handshake(frames, results(), session);
  receipts_->collect(handshake, session, next_id);
  if (receipts_->knew(session))
    spdlog::warn("the matcher had frames of session {:016x} before and refuses repeated ids; restart the matcher",
                 session);
}

SocketReplayTally replay_to_socket(RecordedRun& run, const SocketReplayConfig& config, wire::FrameSink& sink,
                                   MatcherReceipts* receipts, Pace& pace, const std::function<bool()>& stop) {
  const auto begin = Clock::now();
  Sender sender(config, sink, pace, stop);
  for (std::uint64_t round = 0; (config.rounds == 0 || round < config.rounds) && !stop(); ++round) {
    if (round > 0) run.rewind();
    pace.restart();
    sender.send_round(run, round);
  }
  sender.say_goodbye(receipts);
  SocketReplayTally tally;
  tally.left = sink.flush(longest_flush);
  tally.sent = sink.tally().sent;
  tally.refused = sink.tally().refused;
  tally.frames = tally.sent + tally.refused;
  tally.repeated = sender.repeated();
  tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  if (receipts != nullptr) tally.receipt = receipts->receipt();
  return tally;
}

}  // namespace lbea::tool
