#include "tools/record/frame_recorder.hpp"

#include "tools/record/forwarder.hpp"
#include "tools/shared/cli/last_line.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/frame_log.hpp"
#include "tools/shared/intake/frame_receiver.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/recording/run_recorder.hpp"
#include "tools/shared/recording/trigger_signal.hpp"

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include <atomic>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds result_timeout{50};
constexpr std::chrono::milliseconds last_result_timeout{300};  // after stop(), for the last frame's result
constexpr std::chrono::milliseconds last_state_timeout{1200};  // after that; a matcher publishes two per second
constexpr auto max_flush = 2000ms;

struct RecordTally {
  std::uint64_t received = 0;         // frames
  std::uint64_t damaged = 0;          // of these: without a point cloud that can be recorded
  std::uint64_t too_many_points = 0;  // of these: recorded, but larger than a matcher accepts
  std::uint64_t forwarded = 0;
  std::uint64_t refused = 0;               // not forwarded: the matcher had no room
  std::uint64_t undelivered = 0;           // forwarded, but the matcher has not received them
  std::uint64_t missed = 0;                // captures of which no frame arrived, withheld ones included
  std::uint64_t withheld = 0;              // of these: their sender had no room
  std::uint64_t silent = 0;                // senders that stopped without goodbye: what they withheld is unknown
  std::uint64_t interleaved = 0;           // returns to a sender while the test of another one was running
  std::uint64_t lost_results = 0;          // results and states that this subscriber missed
  std::uint64_t unforwarded_controls = 0;  // after stop(): control messages that the matcher did not accept
  /// Every capture of one test arrived as a frame, and reached the matcher too.
  [[nodiscard]] bool is_complete() const noexcept {
    return damaged == 0 && refused == 0 && undelivered == 0 && missed == 0 && silent == 0 && interleaved == 0 &&
           lost_results == 0;
  }
};

/// Receives, records and forwards on one thread, which never waits for the matcher; receives results on another.
class FrameRecorder final : private IntakeSink {
 public:
  /// `forward` and `results` are optional.
  FrameRecorder(wire::FrameSource frames, std::optional<wire::FrameSink> forward,
                std::optional<wire::ResultSource> results, RunRecorder& recorder, wire::WireLimits limits)
      : results_(std::move(results)),
        recorder_(recorder),
        receiver_(std::move(frames), limits, IdTracker::default_sender_timeout, account_, *this) {
    if (forward) forward_.emplace(std::move(*forward));
    try {
      frames_thread_ = std::thread(&FrameRecorder::receive_frames, this);
      if (results_) results_thread_ = std::thread(&FrameRecorder::receive_results, this);
    } catch (...) {  // the destructor does not run
      stop();
      throw;
    }
  }

  ~FrameRecorder() override { stop(); }
  /// Takes in what has arrived, then ends.
  void stop() {
    receiver_.stop();
    for (std::thread* thread : {&frames_thread_, &results_thread_})
      if (thread->joinable()) thread->join();
    undelivered_ = undelivered();
  }

  [[nodiscard]] RecordTally tally() const noexcept {
    const wire::Counters counters = account_.counters.load();
    const std::uint64_t withheld = counters.of(wire::WireStatus::withheld);
    return {.received = counters.received,
            .damaged = damaged_,
            .too_many_points = too_many_points_,
            .forwarded = forwarded_,
            .refused = refused_,
            .undelivered = undelivered_,
            .missed = counters.missed + withheld,
            .withheld = withheld,
            .silent = counters.silent,
            .interleaved = counters.interleaved,
            .lost_results = lost_results_,
            .unforwarded_controls = left_over_.controls};
  }

  /// The senders; at most 100 ms old, and final after stop().
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return account_.senders.load(); }
  /// Logs what has happened since the last call. One thread.
  void write_log() {
    log_.write();
    log_.write(senders());
    log_.write(account_.counters.load());
    peers_.poll(PeerLog::Clock::now());
  }

 private:
  void on_frame(const ReceivedFrame& frame) noexcept override {
    const wire::FrameHeader& header = frame.decoder.header();
    const IdRange id{header.id, 1};
    if (frame.status == wire::WireStatus::end_of_stream) {
      log_.note(frame.status, header.session, id);
      if (forward_) forward_->send_control({{header.session, wire::ControlKind::goodbye, header.id, 0}, true});
      return;
    }
    const bool is_refused = forward_ && !forward_->send(frame.message);
    record(frame);
    log_.note(frame.status, header.session, id);
    if (!forward_) return;
    ++(is_refused ? refused_ : forwarded_);
    if (is_refused) log_.note_refusal(header.session, id);
  }

  void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids, std::int64_t) noexcept override {
    log_.note(status, session, ids);
  }
  void on_control(const wire::Control& control) noexcept override {
    if (forward_) forward_->send_control({control});
  }
  void on_idle() noexcept override {
    if (forward_) forward_->send_pending();
  }
  /// Records every frame with a point cloud, whatever its status.
  void record(const ReceivedFrame& frame) noexcept {
    const wire::FrameHeader& header = frame.decoder.header();
    if (frame.status == wire::WireStatus::ok) recorder_.frame_of_test(header.stamp_ns, frame.receive_ns);
    recorder_.frame(frame.message, header, {frame.receive_ns});
    if (header.cloud.empty()) ++damaged_;
    if (frame.message_status == wire::WireStatus::too_many_points) ++too_many_points_;
  }
  void receive_frames() noexcept {
    receiver_.run();
    if (forward_) left_over_ = forward_->finish(max_flush);
    all_forwarded_ = true;
  }

  /// A broken connection loses frames that were forwarded: the matcher's states tell how many it received.
  [[nodiscard]] std::uint64_t undelivered() const {
    if (!forward_) return 0;
    if (delivered_.empty()) return left_over_.frames;
    const std::uint64_t missing = delivered_.missing_of(senders());
    return missing - std::min(missing, refused_.load());
  }

  void receive_results() noexcept {
    wire::WireResult result;
    wire::WireState state;
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> last_state_due;
    while (true) {
      const bool is_stopping = all_forwarded_;
      if (is_stopping && !last_state_due) last_state_due = Clock::now() + last_state_timeout;
      const auto message = results_->receive(is_stopping ? last_result_timeout : result_timeout);
      if (!message && is_stopping && Clock::now() >= *last_state_due) break;
      if (!message) continue;
      if (wire::decode_result(*message, result) == wire::WireStatus::ok) {
        count_sequence(result.sequence);
        recorder_.result(*message, result);
      } else if (wire::decode_state(*message, state) == wire::WireStatus::ok) {
        count_sequence(state.sequence);
        recorder_.state(*message, state);
        delivered_.add(state);
        if (is_stopping) last_state_due = Clock::now();
      }
    }
  }

  void count_sequence(std::uint64_t sequence) noexcept {
    if (next_sequence_ != 0 && sequence > next_sequence_) lost_results_ += sequence - next_sequence_;
    next_sequence_ = sequence + 1;
  }

  std::optional<Forwarder> forward_;
  std::optional<wire::ResultSource> results_;
  RunRecorder& recorder_;
  SharedAccount account_;
  FrameReceiver receiver_;
  std::uint64_t next_sequence_ = 0;  // 0: none received yet
  std::atomic<std::uint64_t> damaged_{0}, too_many_points_{0}, forwarded_{0}, refused_{0}, lost_results_{0};
  std::atomic<bool> all_forwarded_{false};
  Forwarder::LeftOver left_over_;  // from here on: after stop()
  DeliveredFrames delivered_;
  std::uint64_t undelivered_ = 0;
  FrameLog log_;
  PeerLog peers_{"frames", receiver_};
  std::thread frames_thread_, results_thread_;
};

RunSettings settings_of(const RecordOptions& options) {
  RunSettings settings;
  settings.program = "lbea-record " LBEA_VERSION_STRING;
  settings.matcher.trigger_ns = options.recording.trigger_ns.value_or(0);
  settings.knows_impact = options.recording.trigger_ns ? 1 : 0;
  settings.matcher.max_points = options.max_points;
  settings.start_ns = wire::wall_clock_ns();
  return settings;
}

void print(const RecordTally& tally, const RunObserver::Counts& counts, bool as_json) {
  const nlohmann::ordered_json json{{"received", tally.received},
                                    {"recorded", counts.recorded},
                                    {"unrecorded", counts.unrecorded},
                                    {"damaged", tally.damaged},
                                    {"too_many_points", tally.too_many_points},
                                    {"forwarded", tally.forwarded},
                                    {"refused", tally.refused},
                                    {"undelivered", tally.undelivered},
                                    {"missed", tally.missed},
                                    {"withheld", tally.withheld},
                                    {"silent", tally.silent},
                                    {"interleaved", tally.interleaved},
                                    {"lost_results", tally.lost_results}};
  std::string line;
  for (const auto& [key, value] : json.items()) line += (line.empty() ? "" : ", ") + key + " " + value.dump();
  wait_for_log();
  print_last_line(as_json ? json.dump() : line);
}

/// Logs what is missing from the recording, and what the matcher did not get.
void warn_of_losses(const std::string& file, const RecordTally& tally) {
  std::string losses;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) losses += (losses.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(tally.missed - tally.withheld, "captures that never arrived (missed)");
  add(tally.withheld, "captures without room at their sender (withheld)");
  add(tally.damaged, "messages without a whole point cloud (damaged)");
  add(tally.silent, "senders that stopped without goodbye (their withheld captures are unknown)");
  add(tally.lost_results, "results and states of the matcher");
  if (!losses.empty()) spdlog::warn("{} is incomplete; missing: {}", file, losses);
  if (const std::uint64_t lost = tally.refused + tally.undelivered; lost > 0)
    spdlog::warn("the matcher did not get {} of {} frames; they are recorded", lost, tally.received);
  if (tally.unforwarded_controls > 0)
    spdlog::warn("the senders' last control messages did not reach the matcher; its account ends before them");
}

}  // namespace

int record(const RecordOptions& options) {
  const Log log("lbea-record");
  catch_stop_signals();
  catch_trigger_signal();
  require_distinct_endpoints({{"--frames", options.frames_endpoint},
                              {"--forward", options.forward_endpoint},
                              {"--results", options.results_endpoint}});
  wire::WireContext context;
  wire::WireLimits limits;
  limits.max_points = options.max_points;
  const wire::ClientAccess matcher_access = options.matcher_access.load();
  wire::FrameSource frames(context, options.frames_endpoint, limits, options.server_access.load());
  std::optional<wire::FrameSink> forward;
  std::optional<wire::ResultSource> results;
  if (!options.forward_endpoint.empty())
    forward.emplace(context, options.forward_endpoint, wire::default_queued_messages, matcher_access);
  if (!options.results_endpoint.empty())
    results.emplace(context, options.results_endpoint, wire::results_held, matcher_access);
  const auto recorder = begin_recording(options.recording, settings_of(options));
  RecordingLog watch(recorder.get(), options.recording.file);
  spdlog::info("ready: frames on {}", frames.endpoint());
  warn_of_unbounded_peers();
  FrameRecorder frame_recorder(std::move(frames), std::move(forward), std::move(results), *recorder, limits);
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    watch.poll();
    frame_recorder.write_log();
  }
  frame_recorder.stop();
  frame_recorder.write_log();
  const RecordTally tally = frame_recorder.tally();
  recorder->set_senders(frame_recorder.senders(), tally.interleaved);
  const bool all_recorded = watch.finish();
  warn_of_unfinished(frame_recorder.senders());
  warn_of_losses(options.recording.file, tally);
  print(tally, recorder->counts(), options.json);
  return all_recorded && tally.is_complete() ? exit_ok : exit_failed;
}

}  // namespace lbea::tool
