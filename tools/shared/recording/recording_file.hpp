// The settings and the status of a recorder, and its file: chunks with repeated definitions and loss reports, periodic
// syncs to the disk, and the closing metadata.
#pragma once

#include "adapters/mcap/writer.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <atomic>
#include <thread>

namespace lbea::tool {

/// Only what happens around a trigger is recorded.
struct RecordWindow {
  std::chrono::nanoseconds before{0}, after{0};
};

struct RecorderConfig {
  std::size_t frame_ring_bytes = std::size_t{512} << 20;  // frames waiting for the disk; 0.7 s of 62k points at 1,000/s
  std::size_t note_ring_bytes = std::size_t{8} << 20;     // the same for all other messages
  std::size_t chunk_bytes = std::size_t{4} << 20;         // a chunk is written at this size, ...
  std::chrono::milliseconds longest_wait{5};              // ... or when its first message has waited this long
  std::chrono::milliseconds sync_interval{1000};          // between two syncs to the disk; 0: only at the end
  std::chrono::milliseconds definitions_interval{1000};   // between repetitions of schemas and channels
  // Frames leave this much of the disk, at most an eighth of what is free at the start, to results and states.
  std::uint64_t disk_reserve_bytes = std::uint64_t{64} << 20;
  mcap::Compression compression = mcap::Compression::none;
  std::optional<RecordWindow> window;  // none: everything is recorded
};

/// What the file starts with.
struct RecordingStart {
  mcap::Header header;
  std::vector<mcap::Schema> schemas;
  std::vector<mcap::Channel> channels;
  std::vector<mcap::Metadata> metadata;
  std::uint16_t status_channel = 0;  // one of `channels`: for the recorder's loss reports, as JSON
};

struct RecorderStatus {
  /// What became of the messages of one queue.
  struct Queue {
    std::uint64_t recorded = 0;      // in the file
    std::uint64_t no_room = 0;       // lost: the ring was full
    std::uint64_t write_failed = 0;  // lost: the disk did not accept it
    std::uint64_t outside = 0;       // before or after the window, so not wanted
    [[nodiscard]] std::uint64_t lost() const noexcept { return no_room + write_failed; }
  };
  struct Window {
    bool triggered = false;
    std::int64_t begin_ns = 0, end_ns = 0;  // once triggered
  };
  wire::RecordingPhase phase = wire::RecordingPhase::recording;
  Queue frames, notes;
  std::uint64_t bytes = 0;                                   // in the file
  std::size_t ring_used = 0, ring_peak = 0, ring_bytes = 0;  // of the frames' ring
  std::int64_t longest_write_ns = 0;
  std::uint64_t failed_syncs = 0;
  int last_error = 0;              // the system's error number of the last failed write
  std::optional<Window> window{};  // none: everything is recorded
  [[nodiscard]] std::uint64_t lost() const noexcept { return frames.lost() + notes.lost(); }
  /// The file was closed before any trigger.
  [[nodiscard]] bool has_ended_untriggered() const noexcept {
    return window && !window->triggered &&
           (phase == wire::RecordingPhase::finished || phase == wire::RecordingPhase::failed);
  }
  /// Nothing that was to be recorded is missing so far.
  [[nodiscard]] bool is_sound() const noexcept {
    return lost() == 0 && failed_syncs == 0 && phase != wire::RecordingPhase::failed && !has_ended_untriggered();
  }
};

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
  DiskSyncer(mcap::Sink& sink, std::chrono::milliseconds interval, DiskStatus& disk)
      : sink_(sink), interval_(interval), disk_(disk) {
    if (interval_.count() > 0) thread_ = std::jthread([this](const std::stop_token& stopped) { run(stopped); });
  }
  /// Waits for a running sync. The destructor calls it.
  void stop() noexcept {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

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
  RepeatedDefinitions(const RecordingStart& start, std::chrono::milliseconds interval) : interval_(interval) {
    for (const mcap::Schema& schema : start.schemas) definitions_.schemas.emplace(schema.id, schema);
    for (const mcap::Channel& channel : start.channels) definitions_.channels.emplace(channel.id, channel);
  }
  /// Adds the record of a schema or channel.
  void add(const mcap::Record& record) {
    static_cast<void>(definitions_.add(record));
    changed_ = true;
  }
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
  void confirm(bool written) noexcept {
    if (written && !appended_.empty()) {
      last_ = std::move(appended_);
      ++sequence_;
    }
    appended_.clear();
  }

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
