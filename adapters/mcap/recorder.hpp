// Records messages as they come, on a thread of its own: whoever hands them over waits for nothing. What finds no
// room in memory or on the disk is counted by reason, and the counts stand in the recording too.
#pragma once

#include "adapters/mcap/disk_syncer.hpp"
#include "adapters/mcap/record_lane.hpp"
#include "adapters/mcap/recording_file.hpp"

#include <memory>

namespace lbea::mcap {

class Recorder {
 public:
  enum class Lane : std::uint8_t { frames, notes };

  /// Writes the start of the file and begins. Throws Error{write_failed | bad_config}.
  Recorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RecordingStart& start);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // One thread per lane; neither blocks nor allocates.
  /// False when it was lost, which is counted.
  bool put(Lane lane, const mcap::Message& message) noexcept;
  /// A channel record in bytes, before the first message on it. False when there is no room; nothing is counted.
  bool put_channel(Lane lane, mcap::Bytes record) noexcept;

  /// Something happened at `log_time`: with a window, it is recorded around this time. Only the first one counts.
  void trigger(std::int64_t log_time_ns) noexcept;
  [[nodiscard]] RecorderStatus status() const noexcept;
  /// Before finish() and by the same thread: what the file is to say at its end, unless a window has ended it before.
  void remark(mcap::Metadata remark) { remark_ = std::move(remark); }
  /// Records what was put so far, ends the file and gives it its name. At the latest done by the destructor, which
  /// however leaves nothing of a recording without a single frame: the program did not come to recording.
  RecorderStatus finish() noexcept;

 private:
  using Clock = std::chrono::steady_clock;

  void run() noexcept;
  bool try_tick(bool last) noexcept;
  void tick(bool last);
  void forget_old();
  void begin_window();
  void record(bool last);
  bool write_chunk();
  void end_file() noexcept;
  void drop_rest();
  [[nodiscard]] std::size_t waiting_bytes() const noexcept { return frames_.used() + notes_.used(); }
  [[nodiscard]] std::int64_t window_begin_ns() const noexcept;
  [[nodiscard]] std::int64_t window_end_ns() const noexcept;
  [[nodiscard]] std::optional<RecorderStatus::Window> window() const noexcept;
  [[nodiscard]] bool window_is_over(std::int64_t now_ns) const noexcept;

  std::unique_ptr<mcap::Sink> sink_;
  RecorderConfig config_;
  RepeatedDefinitions definitions_;
  RecordLane frames_, notes_;
  DiskTally disk_;
  RecordingFile file_;
  Clock::time_point waiting_since_{};  // what is in the rings; 0: nothing is
  std::atomic<std::int64_t> trigger_ns_;
  std::atomic<RecorderState> state_;      // changed by the writing thread
  std::optional<mcap::Metadata> remark_;  // the writing thread's once it is stopping
  std::atomic<bool> stopping_{false}, abandoned_{false};
  DiskSyncer syncer_;
  std::thread thread_;  // the writing one; the last member, because it uses all others
};

}  // namespace lbea::mcap
