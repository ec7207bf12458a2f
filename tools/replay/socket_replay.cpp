#include "tools/replay/socket_replay.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/replay/rig_outlet.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/intake/rig_options.hpp"
#include "tools/shared/replaying/frame_fates.hpp"

#include <algorithm>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto longest_flush = 2000ms, time_to_read = 200ms;

bool is_stopped() { return stop_requested != 0; }

/// Round 0 keeps the recorded session; each other round has a new one.
std::uint64_t session_of(std::uint64_t recorded, std::uint64_t round) {
  return recorded ^ (round * 0x9e37'79b9'7f4a'7c15);
}

/// Sends the rounds and counts.
class Sender {
 public:
  /// `receipts` may be null.
  Sender(const SocketReplayOptions& options, const FrameFates& fates, std::vector<RigOutlet>& outlets,
         MatcherReceipts* receipts)
      : options_(options), fates_(fates), outlets_(outlets), receipts_(receipts), pace_(options.pace) {}
  SocketTally send_all(RecordedRun& run) {
    const auto begin = Clock::now();
    for (round_ = 0; (options_.rounds == 0 || round_ < options_.rounds) && !is_stopped(); ++round_) {
      if (round_ > 0) {
        await_ends(true);
        run.rewind();
      }
      pace_.restart();
      send_round(run);
      end_round();
    }
    SocketTally tally;
    for (RigOutlet& outlet : outlets_) tally.add(outlet, outlet.sink.flush(longest_flush));
    tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    tally.worst_lateness_ms = pace_.worst_ms();
    if (receipts_ != nullptr) tally.receipt = receipts_->sum();
    return tally;
  }

 private:
  /// Ends the sessions of the round: the matcher remembers only the latest ones. One that does not answer is not asked
  /// again.
  void end_round() {
    for (RigOutlet& outlet : outlets_) {
      for (const auto& [recorded, next_id] : outlet.next_ids) {
        const bool is_told =
            !options_.ends_stream || outlet.finished.contains(recorded) || end_stream(outlet, recorded, next_id);
        if (receipts_ != nullptr && receipts_->sum().is_whole)
          outlet.received += receipts_->ask(outlet.sink, session_of(recorded, round_), next_id);
        if (!is_told) break;
      }
      outlet.next_ids.clear();
      outlet.tests.clear();
      outlet.frames.clear();
      outlet.finished.clear();
    }
  }
  void send_round(RecordedRun& run) {
    while (const auto message = run.next()) {
      if (message->kind != RecordedMessage::Kind::frame) continue;
      RigOutlet& outlet = outlet_of(*message);
      end_finished_streams(outlet, *message);
      if (!pace_.wait_for(message->log_time_ns)) return;
      end_last_test(outlet, *message);
      end_other_streams(*message);
      await_ends(options_.pace.waits_for_room());
      wait_for_room(outlet);
      if (is_stopped()) return;
      send(outlet, *message);
    }
  }
  RigOutlet& outlet_of(const RecordedMessage& frame) {
    if (outlets_.size() == 1) return outlets_.front();
    const auto found = std::ranges::find(outlets_, frame.rig, &RigOutlet::rig);
    if (found == outlets_.end())
      throw Error(Status::bad_input, "the recording has a frame of rig \"" + std::string(frame.rig) +
                                         "\", which it does not describe; see lbea-inspect");
    return *found;
  }
  void wait_for_room(RigOutlet& outlet) {
    while (options_.pace.waits_for_room() && !is_stopped() && !outlet.sink.wait_ready(Pace::stop_interval)) {}
  }
  bool end_stream(RigOutlet& outlet, std::uint64_t recorded, std::uint64_t next_id) {
    ended_.push_back({&outlet, session_of(recorded, round_), next_id});
    return outlet.sink.tell(encoder_.end_of_stream(session_of(recorded, round_), next_id), longest_flush);
  }
  /// Ends the stream where it ended in the recording.
  void end_last_test(RigOutlet& outlet, const RecordedMessage& frame) {
    const std::uint64_t test = fates_.test_of({frame.session, frame.id}).second;
    const auto [last, is_new] = outlet.tests.try_emplace(frame.session, test);
    if (is_new || std::exchange(last->second, test) >= test || !options_.ends_stream) return;
    wait_for_room(outlet);
    end_stream(outlet, frame.session, frame.id);
  }
  /// The same of the other rigs: a test of several rigs ends when all streams have ended.
  void end_other_streams(const RecordedMessage& frame) {
    if (outlets_.size() == 1 || !options_.ends_stream) return;
    for (RigOutlet& outlet : outlets_)
      for (auto& [session, known] : outlet.tests) {
        const std::uint64_t ends = fates_.ends_before(session, {frame.session, frame.id});
        if (session == frame.session || std::exchange(known, std::max(known, ends)) >= ends) continue;
        wait_for_room(outlet);
        end_stream(outlet, session, outlet.next_ids[session]);
      }
  }
  /// Without recorded ends, the test of sessions that have no frame left ends before the first frame of another session
  /// of a rig.
  void end_finished_streams(const RigOutlet& next, const RecordedMessage& frame) {
    const bool is_another = !next.next_ids.empty() && !next.next_ids.contains(frame.session);
    if (outlets_.size() == 1 || !options_.ends_stream || !is_another) return;
    for (RigOutlet& outlet : outlets_)
      for (const auto& [session, count] : outlet.frames) {
        if (count < fates_.frames_of(session) || fates_.has_end(session) || !outlet.finished.insert(session).second)
          continue;
        wait_for_room(outlet);
        end_stream(outlet, session, outlet.next_ids[session]);
      }
    await_ends(true);
  }
  /// A matcher reads the rigs' sockets by turns. Where no recorded pause lies between two tests, it must have read the
  /// ends of all streams before the first frame of the next test: else that frame belongs to the former one.
  void await_ends(bool has_no_pause) {
    const bool has_several = outlets_.size() > 1 && has_no_pause && !ended_.empty();
    for (const auto& [outlet, session, next_id] : std::exchange(ended_, {})) {
      if (!has_several || is_stopped()) continue;
      if (receipts_ == nullptr || !receipts_->await_end(outlet->sink, session, next_id))
        static_cast<void>(outlet->sink.flush(longest_flush));
    }
    if (has_several && receipts_ == nullptr && !is_stopped()) std::this_thread::sleep_for(time_to_read);
  }
  void send(RigOutlet& outlet, const RecordedMessage& frame) {
    const std::uint64_t session = session_of(frame.session, round_);
    std::uint64_t& next_id = outlet.next_ids[frame.session];
    next_id = std::max(next_id, frame.id + 1);
    ++outlet.frames[frame.session];
    if (outlet.sink.send(encoder_.frame_of_cloud(frame.data, session, frame.id)))
      static_cast<void>(outlet.ids.observe(session, frame.id));
  }
  const SocketReplayOptions& options_;
  const FrameFates& fates_;
  std::vector<RigOutlet>& outlets_;
  MatcherReceipts* receipts_;
  Pace pace_;
  wire::Encoder encoder_;
  std::uint64_t round_ = 0;
  struct End {
    RigOutlet* outlet;
    std::uint64_t session, next_id;
  };
  std::vector<End> ended_;  // streams, since the last frame
};

/// Of each rig. Throws WrongUsage unless all have one.
std::vector<RigEndpoint> endpoints_of(const std::vector<std::string>& to, const std::vector<RigSettings>& rigs) {
  if (rigs.empty()) {
    if (to.size() > 1) throw WrongUsage("--to: the recording has the frames of one rig; give one endpoint");
    if (!divide_rig_option(to.front()).first.empty())
      throw WrongUsage("--to " + to.front() + ": the recording has the frames of one rig; give --to ENDPOINT");
    return {{"", to.front()}};
  }
  const auto values = values_per_recorded_rig(rigs, "--to", "ENDPOINT", to);
  std::vector<RigEndpoint> endpoints;
  std::vector<std::pair<std::string, std::string>> options;
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    const std::string& name = rigs[i].name;
    if (!values[i] || values[i]->empty())
      throw WrongUsage("the recording has frames of rig " + name + "; give --to " + name +
                       "=ENDPOINT too, or match them with --model");
    endpoints.push_back({name, *values[i]});
    options.emplace_back("--to " + name, *values[i]);
  }
  require_distinct_endpoints(options);
  return endpoints;
}

/// A matcher also compares when the frames of several rigs arrive.
void warn_of_pace(const PaceOptions& pace, std::size_t rigs) {
  if (rigs > 1 && (pace.waits_for_room() || pace.speed != 1))
    log_warning(
        "frames of several rigs at another pace than the recorded one: a matcher refuses those that arrive at other "
        "times than their stamps tell (out_of_step); start lbea-serve with a --wait-us longer than the replayed part");
}

}  // namespace

bool replay_to_socket(RecordedRun& run, const SocketReplayOptions& options) {
  const std::vector<RigEndpoint> endpoints = endpoints_of(options.to, run.settings().rigs);
  wire::WireContext context;
  const wire::ClientAccess access = options.access.load();
  warn_of_pace(options.pace, endpoints.size());
  std::vector<RigOutlet> outlets = connected(context, endpoints, access);
  std::optional<MatcherReceipts> receipts;
  if (!options.results_endpoint.empty()) receipts.emplace(context, options.results_endpoint, access);
  const FrameFates fates(run);
  run.rewind();
  const SocketTally tally = Sender(options, fates, outlets, receipts ? &*receipts : nullptr).send_all(run);
  std::printf("%s\n", (options.json ? to_json(tally) : to_text(tally)).c_str());
  const bool is_over = !is_stopped() || options.rounds == 0;  // without a number of rounds, a stop is the regular end
  return is_over && tally.is_complete();
}

}  // namespace lbea::tool
