// Records messages on its own thread, so that the threads that supply them never wait. Messages that find no room in
// memory or on the disk are counted by reason; the recording contains these counts too.
#pragma once

#include "tools/shared/recording/record_queue.hpp"

namespace lbea::tool {

class Recorder {
 public:
  enum class Queue : std::uint8_t { frames, notes };

  /// Writes the start of the file and starts the thread. Throws Error{write_failed | bad_config}.
  Recorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RecordingStart& start);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // One thread per queue; neither function blocks or allocates.
  /// False when the message was lost, which is counted.
  bool put(Queue queue, const mcap::Message& message) noexcept { return at(queue).put(message); }
  /// The record of a channel, before its first message. False when there is no room; nothing is counted.
  bool put_channel(Queue queue, mcap::Bytes record) noexcept { return at(queue).put_channel(record); }

  /// With a window: records around this time. Only the first call counts.
  void trigger(std::int64_t log_time_ns) noexcept;
  [[nodiscard]] RecorderStatus status() const noexcept;
  /// Adds metadata at the end of the file, unless a window has already ended it. Before finish(), on the same thread.
  void set_last_metadata(mcap::Metadata metadata) { last_metadata_ = std::move(metadata); }
  /// Records everything that was put, ends the file and gives it its final name. The destructor calls it too, but then
  /// removes a file without frames.
  RecorderStatus finish() noexcept;

 private:
  using Clock = std::chrono::steady_clock;

  RecordQueue& at(Queue queue) noexcept { return queue == Queue::frames ? frames_ : notes_; }
  void run() noexcept;
  bool try_tick(bool last) noexcept;
  void tick(bool last);
  void record(bool last);
  bool write_chunk();
  bool write_both(const RecordQueue::Batch& notes, const RecordQueue::Batch& frames);
  void end_file() noexcept;
  [[nodiscard]] std::size_t waiting_bytes() const noexcept { return frames_.used() + notes_.used(); }
  [[nodiscard]] std::int64_t window_begin_ns() const noexcept;
  [[nodiscard]] std::int64_t window_end_ns() const noexcept;
  [[nodiscard]] std::optional<RecorderStatus::Window> window() const noexcept;
  [[nodiscard]] bool window_is_over(std::int64_t now_ns) const noexcept;

  std::unique_ptr<mcap::Sink> sink_;
  RecorderConfig config_;
  RepeatedDefinitions definitions_;
  RecordQueue frames_, notes_;
  DiskStatus disk_;
  RecordingFile file_;
  Clock::time_point waiting_since_{};  // since when the rings are not empty; 0: they are
  std::atomic<std::int64_t> trigger_ns_;
  std::atomic<wire::RecordingPhase> phase_;      // changed by the writing thread
  std::optional<mcap::Metadata> last_metadata_;  // the writing thread uses it once it is stopping
  std::atomic<bool> stopping_{false}, abandoned_{false};
  DiskSyncer syncer_;
  std::thread thread_;  // the writing thread; the last member because it uses all others
};

}  // namespace lbea::tool
