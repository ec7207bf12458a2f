#include "tools/record/frame_recorder.hpp"

#include "tools/record/rig_intake.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/intake/rig_options.hpp"
#include "tools/shared/system/trigger_signal.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <thread>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds result_timeout{50};
constexpr std::chrono::milliseconds last_result_timeout{300};  // after stop(), for the last frame's result
constexpr std::chrono::milliseconds last_state_timeout{1200};  // after that; a matcher publishes two per second
constexpr auto max_flush = 2000ms;

/// Receives, records and forwards on one thread, which never waits for the matcher; receives results on another.
class FrameRecorder {
 public:
  /// `results` is optional.
  FrameRecorder(std::vector<ForwardedRig> rigs, std::optional<wire::ResultSource> results, RunRecorder& recorder,
                wire::WireLimits limits)
      : results_(std::move(results)), recorder_(recorder) {
    for (ForwardedRig& rig : rigs)
      rigs_.emplace_back(std::move(rig), static_cast<std::uint32_t>(rigs_.size()), recorder, limits);
    try {
      frames_thread_ = std::thread(&FrameRecorder::receive_frames, this);
      if (results_) results_thread_ = std::thread(&FrameRecorder::receive_results, this);
    } catch (...) {  // the destructor does not run
      stop();
      throw;
    }
  }

  ~FrameRecorder() { stop(); }
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;
  /// Takes in what has arrived, then ends.
  void stop() {
    for (RigIntake& rig : rigs_) rig.receiver().stop();
    for (std::thread* thread : {&frames_thread_, &results_thread_})
      if (thread->joinable()) thread->join();
  }

  /// After stop().
  [[nodiscard]] RunTally tally() const {
    RunTally tally;
    for (const RigIntake& rig : rigs_) {
      const RecordTally of_rig = rig.tally(delivered_);
      tally += of_rig;
      if (rigs_.size() > 1) tally.rigs.push_back({of_rig, rig.name()});
    }
    tally.lost_results = lost_results_;
    tally.is_upper_bound = results_ && (delivered_.has_former() || !has_last_state_);
    return tally;
  }

  /// Of all rigs; final after stop().
  [[nodiscard]] std::vector<wire::WireSender> senders() const {
    std::vector<wire::WireSender> all;
    for (const RigIntake& rig : rigs_) {
      const auto of_rig = rig.senders();
      all.insert(all.end(), of_rig.begin(), of_rig.end());
    }
    return all;
  }
  /// Logs what has happened since the last call. One thread.
  void write_log() {
    for (RigIntake& rig : rigs_) rig.write_log();
  }

 private:
  void receive_frames() noexcept {
    std::vector<FrameReceiver*> receivers;
    for (RigIntake& rig : rigs_) receivers.push_back(&rig.receiver());
    if (receivers.size() == 1)
      receivers.front()->run();
    else
      FrameReceiver::run_together(receivers);
    finish_rigs();
    all_forwarded_ = true;
  }

  /// All within one time, so that a stalled matcher delays the end once.
  void finish_rigs() noexcept {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + max_flush;
    for (RigIntake& rig : rigs_)
      rig.finish(std::chrono::ceil<std::chrono::milliseconds>(std::max(deadline - Clock::now(), Clock::duration(0))));
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
        has_last_state_ = is_stopping;
      }
    }
  }

  void count_sequence(std::uint64_t sequence) noexcept {
    if (next_sequence_ != 0 && sequence > next_sequence_) lost_results_ += sequence - next_sequence_;
    next_sequence_ = sequence + 1;
  }

  std::deque<RigIntake> rigs_;
  std::optional<wire::ResultSource> results_;
  RunRecorder& recorder_;
  std::uint64_t next_sequence_ = 0;  // 0: none received yet
  std::atomic<std::uint64_t> lost_results_{0};
  std::atomic<bool> all_forwarded_{false};
  DeliveredFrames delivered_;    // from here on: read after stop()
  bool has_last_state_ = false;  // published after everything was forwarded
  std::thread frames_thread_, results_thread_;
};

RunSettings settings_of(const RecordOptions& options) {
  RunSettings settings;
  settings.program = "lbea-record " LBEA_VERSION_STRING;
  settings.matcher.trigger_ns = options.recording.trigger_ns.value_or(0);
  settings.knows_impact = options.recording.trigger_ns ? 1 : 0;
  settings.matcher.max_points = options.max_points;
  settings.matcher.T_reference_sensor = options.rigs.front().T_reference_sensor;
  settings.sensor_json = options.rigs.front().sensor_json;
  if (options.rigs.size() > 1) settings.rigs.assign(options.rigs.begin(), options.rigs.end());
  settings.start_ns = wire::wall_clock_ns();
  return settings;
}

std::vector<ForwardedRig> connect(wire::WireContext& context, const RecordOptions& options,
                                  const wire::WireLimits& limits, const wire::ClientAccess& matcher_access) {
  std::vector<ForwardedRig> rigs;
  const wire::ServerAccess access = options.server_access.load();
  for (const NamedRig& rig : options.rigs)
    rigs.push_back({options.rigs.size() > 1 ? rig.name : "", rig.clock_offset_ns,
                    wire::FrameSource(context, rig.endpoint, limits, access)});
  for (std::size_t i = 0; i < options.forward_endpoints.size(); ++i)
    rigs[i].forward.emplace(context, options.forward_endpoints[i], wire::default_queued_messages, matcher_access);
  return rigs;
}

std::vector<std::pair<std::string, std::string>> endpoints_of(const RecordOptions& options) {
  std::vector<std::pair<std::string, std::string>> endpoints = frames_endpoints(options.rigs);
  for (std::size_t i = 0; i < options.forward_endpoints.size(); ++i)
    endpoints.emplace_back(options.rigs.size() > 1 ? "--forward " + options.rigs[i].name : "--forward",
                           options.forward_endpoints[i]);
  endpoints.emplace_back("--results", options.results_endpoint);
  return endpoints;
}

std::string ready_line(const std::vector<ForwardedRig>& rigs) {
  std::string text = "ready: ";
  for (const ForwardedRig& rig : rigs)
    text += (&rig == &rigs.front() ? "" : ", ") + std::string("frames") + (rig.name.empty() ? "" : " of " + rig.name) +
            " on " + rig.frames.endpoint();
  return text;
}

}  // namespace

void read_rigs(RecordOptions& options) {
  options.rigs = read_rigs(options.rig_options);
  std::vector<std::string> names;
  for (const NamedRig& rig : options.rigs) names.push_back(rig.name);
  const auto forward = values_per_rig(names, {"--forward", "ENDPOINT"}, options.forward);
  options.forward_endpoints.clear();
  for (std::size_t i = 0; i < names.size() && !options.forward.empty(); ++i) {
    if (!forward[i] || forward[i]->empty())
      throw WrongUsage("the frames of rig " + names[i] + " are not forwarded; give --forward " + names[i] +
                       "=ENDPOINT too, or none");
    options.forward_endpoints.push_back(*forward[i]);
  }
}

int record(RecordOptions options) {
  const Log log("lbea-record");
  catch_stop_signals();
  catch_trigger_signal();
  require_distinct_endpoints(endpoints_of(options));
  read_poses(options.rigs);
  wire::WireContext context;
  wire::WireLimits limits;
  limits.max_points = options.max_points;
  const wire::ClientAccess matcher_access = options.matcher_access.load();
  std::vector<ForwardedRig> rigs = connect(context, options, limits, matcher_access);
  std::optional<wire::ResultSource> results;
  if (!options.results_endpoint.empty())
    results.emplace(context, options.results_endpoint, wire::results_held, matcher_access);
  const auto recorder = begin_recording(options.recording, settings_of(options));
  RecordingLog watch(recorder.get(), options.recording.file);
  log_info("{}", ready_line(rigs));
  warn_of_unbounded_peers();
  FrameRecorder frame_recorder(std::move(rigs), std::move(results), *recorder, limits);
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    watch.poll();
    frame_recorder.write_log();
  }
  frame_recorder.stop();
  frame_recorder.write_log();
  const RunTally tally = frame_recorder.tally();
  recorder->set_senders(frame_recorder.senders(), tally.interleaved);
  const bool all_recorded = watch.finish();
  warn_of_unfinished(frame_recorder.senders());
  warn_of_losses(options.recording.file, tally);
  print(tally, recorder->counts(), options.json);
  return all_recorded && tally.is_complete() ? exit_ok : exit_failed;
}

}  // namespace lbea::tool
