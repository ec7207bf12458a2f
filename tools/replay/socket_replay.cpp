#include "tools/replay/socket_replay.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/clock_times.hpp"
#include "tools/shared/intake/handshake.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/replaying/frame_fates.hpp"

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <thread>

#include <poll.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto longest_wait = 5s;     // for the receiver, and for a matcher's state
constexpr auto stop_interval = 50ms;  // longest delay of a stop
constexpr auto longest_flush = 2000ms;
constexpr double longest_disorder_ns = 1e9, long_pause_ns = 1e10;
constexpr double latest_ns = 4e18;  // 127 years; the clock would overflow far beyond it

bool is_stopped() { return stop_requested != 0; }

/// Round 0 keeps the recorded session; each other round has a new one.
std::uint64_t session_of(std::uint64_t recorded, std::uint64_t round) {
  return recorded ^ (round * 0x9e37'79b9'7f4a'7c15);
}

bool wait_for_line() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!is_stopped()) {
    if (::poll(&input, 1, static_cast<int>(stop_interval.count())) <= 0) continue;
    char letter = 0;
    do {
      if (::read(STDIN_FILENO, &letter, 1) != 1) return false;
    } while (letter != '\n');
    return true;
  }
  return false;
}

/// When each frame is sent.
class Pace {
 public:
  explicit Pace(const SocketReplayOptions& options) : options_(options) {}
  /// Waits until a frame received at `log_time_ns` is due, relative to the first call. False when the replay is stopped
  /// or standard input has ended.
  bool wait_for(std::int64_t log_time_ns) {
    if (options_.steps) return wait_for_line();
    if (options_.fast) return !is_stopped();
    // Older recordings may contain a step of the clock. After a step backwards the pace starts anew.
    const double pause_ns = difference_ns(log_time_ns, last_ns_);
    if (!begun_ || pause_ns < -longest_disorder_ns) {
      begin_at(log_time_ns);
    } else if (pause_ns > long_pause_ns) {
      spdlog::info("no frame for {:.0f} s of the recording; --fast does not wait", 1e-9 * pause_ns);
    }
    last_ns_ = log_time_ns;
    const double offset_ns = std::min(difference_ns(log_time_ns, first_ns_) / options_.speed, latest_ns);
    const auto due = begin_ + std::chrono::nanoseconds(static_cast<std::int64_t>(offset_ns));
    while (!is_stopped() && Clock::now() < due)
      std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
    worst_ = std::max(worst_, std::chrono::nanoseconds(Clock::now() - due));
    return !is_stopped();
  }
  /// The next frame is due at once; later ones are relative to it.
  void restart() { begun_ = false; }
  /// The largest delay of a frame.
  [[nodiscard]] double worst_ms() const noexcept { return static_cast<double>(worst_.count()) * 1e-6; }

 private:
  void begin_at(std::int64_t log_time_ns) {
    begun_ = true;
    begin_ = Clock::now();
    first_ns_ = log_time_ns;
  }

  const SocketReplayOptions& options_;
  bool begun_ = false;
  Clock::time_point begin_{};
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  std::chrono::nanoseconds worst_{0};
};

/// The matcher's receipts for the replayed frames.
class MatcherReceipts {
 public:
  /// Waits for the first state of the matcher. Throws Error{bad_config | endpoint_unavailable}.
  MatcherReceipts(wire::WireContext& context, const std::string& results_endpoint, const wire::ClientAccess& access)
      : context_(context), endpoint_(results_endpoint), access_(access) {
    wire::ResultSource source = results();
    auto state = wait_for_state(
        source, [deadline = Clock::now() + longest_wait] { return is_stopped() || Clock::now() >= deadline; });
    if (!state)
      throw Error(Status::endpoint_unavailable,
                  "endpoint \"" + endpoint_ +
                      "\": no matcher publishes results there; give the endpoint of lbea-serve --results");
    receipts_.emplace(std::move(*state));
  }
  /// Says goodbye for a session whose ids are all below `next_id` and adds the matcher's receipt. Warns when the
  /// matcher had frames of that session before.
  void ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id) {
    Handshake handshake(frames, results(), session);
    receipts_->collect(handshake, session, next_id);
    if (receipts_->knew(session))
      spdlog::warn("the matcher had frames of session {:016x} before and refuses repeated ids; restart the matcher",
                   session);
  }
  [[nodiscard]] const Receipt& sum() const noexcept { return receipts_->sum(); }

 private:
  [[nodiscard]] wire::ResultSource results() const { return {context_, endpoint_, wire::results_held, access_}; }
  wire::WireContext& context_;
  std::string endpoint_;
  wire::ClientAccess access_;
  std::optional<Receipts> receipts_;
};

struct SocketTally {
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;   // the receiver had no room
  std::uint64_t left = 0;      // sent, but not transferred to the receiver before the end
  std::uint64_t repeated = 0;  // sent, but with an id that was used before, and so refused by the matcher
  double seconds = 0, worst_lateness_ms = 0;
  std::optional<Receipt> receipt;
  /// No loss is known.
  [[nodiscard]] bool is_complete() const noexcept {
    return refused == 0 && left == 0 &&
           (!receipt || (receipt->is_whole && receipt->received + repeated >= sent && receipt->dropped == 0));
  }
};

std::string to_text(const SocketTally& tally) {
  const auto number = [](std::uint64_t value) -> unsigned long long { return value; };
  return formatted("frames %llu = sent %llu + refused %llu; %llu not delivered; %.3f s, largest delay %.3f ms",
                   number(tally.sent + tally.refused), number(tally.sent), number(tally.refused), number(tally.left),
                   tally.seconds, tally.worst_lateness_ms) +
         (tally.receipt ? receipt_text(*tally.receipt) : "");
}

std::string to_json(const SocketTally& tally) {
  nlohmann::ordered_json json{{"frames", tally.sent + tally.refused},
                              {"sent", tally.sent},
                              {"refused", tally.refused},
                              {"left", tally.left},
                              {"seconds", tally.seconds},
                              {"worst_lateness_ms", tally.worst_lateness_ms}};
  if (tally.receipt && tally.receipt->is_whole) json["receipt"] = receipt_json(*tally.receipt);
  return json.dump();
}

/// Sends the rounds and counts.
class Sender {
 public:
  Sender(const SocketReplayOptions& options, const FrameFates& fates, wire::FrameSink& sink)
      : options_(options), fates_(fates), sink_(sink), pace_(options) {}
  /// `receipts` may be null.
  SocketTally send_all(RecordedRun& run, MatcherReceipts* receipts) {
    const auto begin = Clock::now();
    for (std::uint64_t round = 0; (options_.rounds == 0 || round < options_.rounds) && !is_stopped(); ++round) {
      if (round > 0) run.rewind();
      pace_.restart();
      send_round(run, round);
      end_round(receipts);
    }
    SocketTally tally;
    tally.left = sink_.flush(longest_flush);
    tally.sent = sink_.tally().sent;
    tally.refused = sink_.tally().refused;
    tally.repeated = ids_.duplicates();
    tally.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    tally.worst_lateness_ms = pace_.worst_ms();
    if (receipts != nullptr) tally.receipt = receipts->sum();
    return tally;
  }

 private:
  /// Ends the sessions of the round: the matcher remembers only the latest ones. One that does not answer is not asked
  /// again.
  void end_round(MatcherReceipts* receipts) {
    for (const auto& [session, next_id] : next_ids_) {
      const bool is_told = !options_.ends_stream || sink_.tell(encoder_.end_of_stream(session, next_id), longest_flush);
      if (receipts != nullptr && receipts->sum().is_whole) receipts->ask(sink_, session, next_id);
      if (!is_told) break;
    }
    next_ids_.clear();
    tests_.clear();
  }
  void send_round(RecordedRun& run, std::uint64_t round) {
    while (const auto message = run.next()) {
      if (message->kind != RecordedMessage::Kind::frame) continue;
      if (!pace_.wait_for(message->log_time_ns)) return;
      end_last_test(*message, session_of(message->session, round));
      wait_for_room();
      if (is_stopped()) return;
      send(*message, session_of(message->session, round));
    }
  }
  void wait_for_room() {
    const bool waits = options_.fast || options_.steps;
    while (waits && !is_stopped() && !sink_.wait_ready(stop_interval)) {}
  }
  /// Ends the stream where it ended in the recording.
  void end_last_test(const RecordedMessage& frame, std::uint64_t session) {
    const std::uint64_t test = fates_.test_of({frame.session, frame.id}).second;
    const auto [last, is_new] = tests_.try_emplace(session, test);
    if (is_new || std::exchange(last->second, test) >= test || !options_.ends_stream) return;
    wait_for_room();
    sink_.tell(encoder_.end_of_stream(session, frame.id), longest_flush);
  }
  void send(const RecordedMessage& frame, std::uint64_t session) {
    std::uint64_t& next_id = next_ids_[session];
    next_id = std::max(next_id, frame.id + 1);
    if (sink_.send(encoder_.frame_of_cloud(frame.data, session, frame.id)))
      static_cast<void>(ids_.observe(session, frame.id));
  }
  const SocketReplayOptions& options_;
  const FrameFates& fates_;
  wire::FrameSink& sink_;
  Pace pace_;
  wire::Encoder encoder_;
  IdTracker ids_;
  std::map<std::uint64_t, std::uint64_t> next_ids_;  // of each session, for the goodbye
  std::map<std::uint64_t, std::uint64_t> tests_;     // the number of each session's latest test
};

}  // namespace

bool replay_to_socket(RecordedRun& run, const SocketReplayOptions& options) {
  if (!run.settings().rigs.empty())
    throw Error(Status::bad_config,
                "the recording has frames of several rigs, and --to sends all frames to one "
                "endpoint; match them with --model");
  wire::WireContext context;
  const wire::ClientAccess access = options.access.load();
  wire::FrameSink sink(context, options.endpoint, wire::default_queued_messages, access);
  const auto deadline = Clock::now() + longest_wait;
  while (!sink.wait_ready(stop_interval))
    if (is_stopped() || Clock::now() > deadline)
      throw Error(Status::endpoint_unavailable, "endpoint \"" + options.endpoint +
                                                    "\": no program listens there; start lbea-serve with --frames " +
                                                    options.endpoint);
  std::optional<MatcherReceipts> receipts;
  if (!options.results_endpoint.empty()) receipts.emplace(context, options.results_endpoint, access);
  const FrameFates fates(run);
  run.rewind();
  const SocketTally tally = Sender(options, fates, sink).send_all(run, receipts ? &*receipts : nullptr);
  std::printf("%s\n", (options.json ? to_json(tally) : to_text(tally)).c_str());
  const bool is_over = !is_stopped() || options.rounds == 0;  // without a number of rounds, a stop is the regular end
  return is_over && tally.is_complete();
}

}  // namespace lbea::tool
