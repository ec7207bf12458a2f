// The command line of programs that record, and what they tell the operator meanwhile.
#pragma once

#include "tools/shared/cli/tool.hpp"
#include "tools/shared/recording/run_recorder.hpp"

namespace lbea::tool {

struct RecordingOptions {
  std::string file;    // as it is called now, see recording_name(); empty: nothing is recorded
  std::string window;  // BEFORE:AFTER in seconds; empty: all is recorded
  std::size_t memory_mb = mcap::RecorderConfig{}.frame_ring_bytes >> 20;
  mcap::RecorderConfig config;               // the rest
  std::optional<std::int64_t> trigger_ns{};  // --trigger-ns, when it was given; 0 is a time like any other
};

/// For the option that names the file: puts the time of the start in place of strftime's conversions
/// (%Y-%m-%d_%H-%M-%S; a percent sign is %%), and refuses a name that is empty or that strftime cannot read.
[[nodiscard]] Check recording_name();

/// All but the file's name, which is an option of one program and an argument of another.
void add_recording_options(Tool& tool, RecordingOptions& options);

/// What begin_recording() would refuse. Throws the same; leaves nothing behind.
void check_recording(const RecordingOptions& options);

/// From now on SIGUSR1 triggers, or where there is nothing to trigger is answered with a warning.
void catch_trigger_signal();

/// Null without a file. With a window, the first frame captured at options.trigger_ns or later triggers too. Throws
/// Error{bad_config | write_failed}.
[[nodiscard]] std::unique_ptr<RunRecorder> begin_recording(const RecordingOptions& options, RunSettings settings);

/// Log lines about a recording that goes on: at most one a second of each kind.
class RecordingWatch {
 public:
  /// `recorder` may be null: then there is nothing to see.
  RecordingWatch(RunRecorder* recorder, std::string file) : recorder_(recorder), file_(std::move(file)) {}
  /// Every now and then: passes on a trigger, and says what is new.
  void look();
  /// Ends the file and says how it went; whether nothing is missing in it.
  bool finish();

 private:
  using Clock = std::chrono::steady_clock;
  void pass_on_trigger();
  void note(const mcap::RecorderStatus& status);
  void note_end(const mcap::RecorderStatus& status);
  [[nodiscard]] std::uint64_t lost() const;
  RunRecorder* recorder_;
  std::string file_;
  mcap::RecorderState state_ = mcap::RecorderState::recording;
  std::uint64_t lost_ = 0, failed_syncs_ = 0;
  Clock::time_point last_loss_{}, last_crowd_{}, last_look_at_disk_{};
};

}  // namespace lbea::tool
