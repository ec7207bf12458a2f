// The command line of programs that record, and what they tell the operator meanwhile.
#pragma once

#include "tools/common/tool.hpp"
#include "tools/recording/run_recorder.hpp"

namespace lbea {

struct RecordingOptions {
  std::string file;    // empty: nothing is recorded
  std::string window;  // BEFORE:AFTER in seconds; empty: all is recorded
  std::size_t memory_mb = RecorderConfig{}.frame_ring_bytes >> 20;
  RecorderConfig config;  // the rest
};

/// All but the file's name, which is an option of one program and an argument of another.
void add_recording_options(Tool& tool, RecordingOptions& options);

/// What begin_recording() would refuse. Throws the same; leaves nothing behind.
void check_recording(const RecordingOptions& options);

/// Null without a file. With a window, SIGUSR1 triggers from now on, as does the first frame captured at
/// settings.matcher.trigger_ns or later, unless that is 0. Throws Error{bad_config | write_failed}.
[[nodiscard]] std::unique_ptr<RunRecorder> begin_recording(const RecordingOptions& options, const RunSettings& settings);

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
  void note(const RecorderStatus& status);
  RunRecorder* recorder_;
  std::string file_;
  RecorderState state_ = RecorderState::recording;
  std::uint64_t lost_ = 0, failed_syncs_ = 0;
  Clock::time_point last_loss_{}, last_crowd_{}, last_look_at_disk_{};
};

}  // namespace lbea
