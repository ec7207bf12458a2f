#include "tools/replay/socket_replay.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>
#include <map>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
constexpr auto ready_interval = 50ms;
constexpr auto longest_farewell = 2000ms;

/// Round 0 keeps the session; others get one that is as good as new.
std::uint64_t session_of(std::uint64_t recorded, std::uint64_t round) {
  return recorded ^ (round * 0x9e37'79b9'7f4a'7c15);
}

/// Sends the rounds, and knows what it has sent.
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
  void say_goodbye(MatcherWitness* witness) {
    for (const auto& [session, next_id] : next_ids_) {
      if (config_.ends_stream) sink_.tell(encoder_.end_of_stream(session, next_id), longest_farewell);
      if (witness != nullptr) witness->ask(sink_, session, next_id);
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
  std::map<std::uint64_t, std::uint64_t> next_ids_;  // of each session, to say what would have come next
};

}  // namespace

SocketReplayTally replay_to_socket(RecordedRun& run, const SocketReplayConfig& config, wire::FrameSink& sink,
                                   MatcherWitness* witness, Pace& pace, const std::function<bool()>& stop) {
  const auto begin = std::chrono::steady_clock::now();
  Sender sender(config, sink, pace, stop);
  for (std::uint64_t round = 0; (config.rounds == 0 || round < config.rounds) && !stop(); ++round) {
    if (round > 0) run.rewind();
    pace.restart();
    sender.send_round(run, round);
  }
  sender.say_goodbye(witness);
  SocketReplayTally tally;
  tally.left = sink.flush(longest_farewell);
  tally.sent = sink.tally().sent;
  tally.refused = sink.tally().refused;
  tally.frames = tally.sent + tally.refused;
  tally.repeated = sender.repeated();
  tally.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (witness != nullptr) tally.receipt = witness->receipt();
  return tally;
}

}  // namespace lbea::tool
