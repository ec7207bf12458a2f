#include "tools/replay/socket_replay.hpp"

#include "adapters/wire/codec.hpp"

#include <map>

namespace lbea {

namespace {

using namespace std::chrono_literals;
constexpr auto ready_interval = 50ms;
constexpr auto longest_farewell = 2000ms;

/// Round 0 keeps the session; others get one that is as good as new.
std::uint64_t session_of(std::uint64_t recorded, std::uint64_t round) { return recorded ^ (round * 0x9e37'79b9'7f4a'7c15); }

/// The last id of each session, to say what would have come next.
using Sessions = std::map<std::uint64_t, std::uint64_t>;

void send_round(RecordedRun& run, std::uint64_t round, const SocketReplayConfig& config, FrameSink& sink, Pace& pace,
                const std::function<bool()>& stop, Sessions& sessions) {
  Encoder encoder;
  while (const auto message = run.next()) {
    if (message->kind != RecordedMessage::Kind::frame) continue;
    if (!pace.wait_for(message->log_time_ns)) return;
    while (config.waits && !stop() && !sink.wait_ready(ready_interval)) {
    }
    if (stop()) return;
    const std::uint64_t session = session_of(message->session, round);
    sink.send(encoder.frame_of_cloud(message->data, session, message->id));
    sessions[session] = message->id;
  }
}

}  // namespace

SocketReplayTally replay_to_socket(RecordedRun& run, const SocketReplayConfig& config, FrameSink& sink, Pace& pace,
                                   const std::function<bool()>& stop) {
  const auto begin = std::chrono::steady_clock::now();
  Sessions sessions;
  for (std::uint64_t round = 0; (config.rounds == 0 || round < config.rounds) && !stop(); ++round) {
    if (round > 0) run.rewind();
    pace.restart();
    send_round(run, round, config, sink, pace, stop, sessions);
  }
  const FrameSink::Tally tally = sink.tally();
  Encoder encoder;
  for (const auto& [session, last_id] : sessions)
    if (config.ends_stream) sink.tell(encoder.end_of_stream(session, last_id + 1), longest_farewell);
  const std::uint64_t left = sink.flush(longest_farewell);
  return {tally.sent + tally.refused, tally.sent, tally.refused, left,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()};
}

}  // namespace lbea
