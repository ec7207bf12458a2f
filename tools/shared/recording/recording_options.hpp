// The command line of programs that record, and their log of the recording.
#pragma once

#include "tools/shared/cli/tool.hpp"
#include "tools/shared/recording/run_recorder.hpp"

namespace lbea::tool {

struct RecordingOptions {
  std::string file;    // the name after recording_name(); empty: nothing is recorded
  std::string window;  // BEFORE:AFTER in seconds; empty: everything is recorded
  std::size_t memory_mb = RecorderConfig{}.frame_ring_bytes >> 20;
  RecorderConfig config;                     // all other settings
  std::optional<std::int64_t> trigger_ns{};  // --trigger-ns, if it was given; 0 is a valid time
};

/// For the option with the file's name: replaces strftime's conversions (%Y-%m-%d_%H-%M-%S; %% is a percent sign) with
/// the start time, and rejects an empty name or one that strftime cannot read.
[[nodiscard]] Check recording_name();

/// All options but the file's name, which is an argument in one program and an option in another.
void add_recording_options(Tool& tool, RecordingOptions& options);

/// Throws what begin_recording() would throw, and leaves no file.
void check_recording(const RecordingOptions& options);

/// Null without a file. With a window, the first frame captured at options.trigger_ns or later is a trigger too. Throws
/// Error{bad_config | write_failed}.
[[nodiscard]] std::unique_ptr<RunRecorder> begin_recording(const RecordingOptions& options, RunSettings settings);

/// Logs the progress of a recording: at most one line of each kind per second.
class RecordingLog {
 public:
  /// `recorder` may be null; then a trigger only causes a warning.
  RecordingLog(RunRecorder* recorder, std::string file) : recorder_(recorder), file_(std::move(file)) {}
  /// Call periodically: forwards a trigger, logs changes, and steps of the system's clock.
  void poll();
  /// Ends the file and logs its state; false when anything is missing in it.
  bool finish();

 private:
  using Clock = std::chrono::steady_clock;
  void forward_trigger();
  void log_clock_step();
  void log_changes(const RecorderStatus& status);
  void log_end(const RecorderStatus& status);
  [[nodiscard]] std::uint64_t lost() const;
  RunRecorder* recorder_;
  std::string file_;
  wire::RecordingPhase phase_ = wire::RecordingPhase::recording;
  std::uint64_t lost_ = 0, failed_syncs_ = 0;
  std::int64_t clock_step_ns_ = 0;  // since the start
  Clock::time_point last_loss_{}, last_warning_{}, last_disk_check_{};
};

}  // namespace lbea::tool
