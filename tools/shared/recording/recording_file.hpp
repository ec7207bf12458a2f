// Writes the file of a recording: chunks with repeated definitions and loss reports, periodic syncs to the disk, and
// the closing metadata.
#pragma once

#include "adapters/mcap/writer.hpp"
#include "tools/shared/recording/recorder_config.hpp"

#include <atomic>
#include <thread>

namespace lbea::tool {

/// Written by the writing and the syncing thread, read by any thread.
struct DiskStatus {
  std::atomic<std::uint64_t> bytes{0};  // in the file
  std::atomic<std::uint64_t> failed_syncs{0};
  std::atomic<std::int64_t> longest_write_ns{0};
  std::atomic<int> last_error{0};  // the system's error number
};

/// Syncs a file to the disk periodically, on its own thread, so that recording does not wait for a slow disk.
class DiskSyncer {
 public:
  /// Starts the thread unless `interval` is 0. `sink` and `disk` must outlive it. Throws std::system_error.
  DiskSyncer(mcap::Sink& sink, std::chrono::milliseconds interval, DiskStatus& disk);
  /// Waits for a running sync. The destructor calls it.
  void stop() noexcept;

 private:
  void run(const std::stop_token& stopped) noexcept;
  mcap::Sink& sink_;
  std::chrono::milliseconds interval_;
  DiskStatus& disk_;
  std::jthread thread_;
};

/// The schemas and channels of a recording. They are written first, after a chunk was lost, and periodically, so that
/// the readable parts of a damaged file can be decoded. For one thread.
class RepeatedDefinitions {
 public:
  RepeatedDefinitions(const RecordingStart& start, std::chrono::milliseconds interval);
  /// Adds the record of a schema or channel.
  void add(const mcap::Record& record);
  /// Appends all of them to the front of a chunk when they are due.
  void append_when_due(mcap::Buffer& front, bool has_messages);
  /// Whether that chunk is in the file.
  void confirm(bool written) noexcept { changed_ = !written; }

 private:
  using Clock = std::chrono::steady_clock;
  mcap::Definitions definitions_;
  std::chrono::milliseconds interval_;
  Clock::time_point due_{};
  bool changed_ = true;  // since they were last written
};

/// The recorder's losses and phase as one JSON object. It changes only when one of them does.
[[nodiscard]] std::string loss_report_json(const RecorderStatus& status);
/// The JSON schema of loss_report_json().
[[nodiscard]] std::string_view loss_report_schema() noexcept;

/// Loss reports as messages of the recording, one after each change. For one thread.
class LossReports {
 public:
  explicit LossReports(std::uint16_t channel) : channel_(channel) {}
  [[nodiscard]] bool is_due(std::chrono::steady_clock::time_point now) const noexcept { return now >= due_; }
  void append_when_due(mcap::Buffer& out, const RecorderStatus& status);
  void append_when_changed(mcap::Buffer& out, const RecorderStatus& status);
  /// Whether the appended report is in the file. If not, it is appended again.
  void confirm(bool written) noexcept;

 private:
  std::uint16_t channel_;
  std::uint32_t sequence_ = 0;
  std::chrono::steady_clock::time_point due_{};
  std::string last_, appended_;
};

/// The last record of the data: how many messages were recorded and lost.
[[nodiscard]] mcap::Metadata closing_metadata(const RecorderStatus& status);
inline constexpr std::string_view closing_metadata_name = "lbea.recording.end";
/// Its keys with a window: "yes" or "no", and the window in the recorder's time.
inline constexpr std::string_view triggered_key = "triggered", window_begin_key = "window_begin_ns",
                                  window_end_key = "window_end_ns";
/// The number of frames before or after the window.
inline constexpr std::string_view frames_outside_key = "frames_outside";

/// For one thread. The caller counts the messages that could not be written.
class RecordingFile {
 public:
  /// Writes the start. All arguments but `start` must outlive the object. Throws Error{write_failed}.
  RecordingFile(mcap::Sink& sink, mcap::Compression compression, const RecordingStart& start,
                RepeatedDefinitions& definitions, DiskStatus& disk);

  [[nodiscard]] bool report_is_due(std::chrono::steady_clock::time_point now) const noexcept {
    return reports_.is_due(now);
  }
  /// Writes a chunk if there is anything to write. False when the sink failed. Throws std::bad_alloc before anything is
  /// written.
  [[nodiscard]] bool write(mcap::Bytes notes, mcap::Bytes frames, const RecorderStatus& status);

  // The end, in this order. Each is false when it failed.
  [[nodiscard]] bool write_last_report(const RecorderStatus& status) noexcept;
  [[nodiscard]] bool write(const mcap::Metadata& metadata) noexcept;
  /// Writes closing metadata and summary, syncs the file, and gives it its final name.
  [[nodiscard]] bool close(const RecorderStatus& status) noexcept;

 private:
  int write_start(const RecordingStart& start);
  template <class Step>
  bool run(const Step& step) noexcept;

  mcap::Sink& sink_;
  mcap::Writer writer_;
  RepeatedDefinitions& definitions_;
  LossReports reports_;
  DiskStatus& disk_;
  mcap::Buffer front_;  // of the chunk: definitions and loss report
};

}  // namespace lbea::tool
