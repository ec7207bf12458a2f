// With several rigs: the thread that makes captures of queued frames and turns each into one outcome.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"
#include "tools/shared/matching/side_by_side.hpp"

namespace lbea::tool {

/// Tells when another test begins, by the sessions of the rigs' senders. A test ends when all its senders have ended or
/// are silent.
class RigTests {
 public:
  explicit RigTests(std::size_t rigs, std::chrono::nanoseconds sender_timeout)
      : timeout_ns_(sender_timeout.count()), rigs_(rigs) {}
  /// Whether the frame is the first of another test: its sender is new, or has ended its stream, and no other rig's
  /// sender is running.
  [[nodiscard]] bool begins(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept;
  [[nodiscard]] bool is_running(std::uint32_t rig, std::uint64_t session) const noexcept;
  /// The rig's sender has ended its stream. Whether this ends the test.
  [[nodiscard]] bool end(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept;

 private:
  struct Sender {
    std::uint64_t session = 0;
    std::int64_t receive_ns = 0;  // of its latest frame
    bool is_running = false;
  };
  [[nodiscard]] bool any_runs(std::int64_t now_ns) const noexcept;

  std::int64_t timeout_ns_;
  std::vector<Sender> rigs_;
};

class CaptureMatcher {
 public:
  CaptureMatcher(const PipelineConfig& config, RigEngine& engine, PipelineQueues& queues);
  /// Runs until the queue of frames is closed and empty.
  void run() noexcept;
  // Any thread:
  /// The id of the first frame of the capture that is being matched, or of the one that was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept { return current_frame_; }
  /// Rises while nothing is being matched, and with each outcome.
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool take_frames() noexcept;
  void take(FrameSlot& slot) noexcept;
  [[nodiscard]] bool match_next(bool at_once) noexcept;
  void match(std::span<const WaitingFrame> capture) noexcept;
  void describe(wire::WireResult& result, std::span<const WaitingFrame> capture) noexcept;
  void match_all() noexcept;
  [[nodiscard]] bool has_ended(std::uint32_t rig) noexcept;
  void finish_ends() noexcept;
  void begin_test(const FrameSlot& first) noexcept;
  void publish_end_of_test(std::int64_t receive_ns) noexcept;
  void publish(wire::WireStatus status, const FrameSlot& slot) noexcept;
  void finish(std::uint64_t turn) noexcept;
  [[nodiscard]] FrameSlot& slot_of(const WaitingFrame& frame) noexcept { return *queues_.frames.at(frame.turn); }
  /// Longer waiting would use up a rig's share of the queue.
  [[nodiscard]] bool is_crowded() const noexcept { return 4 * grouping_.most_waiting() >= 3 * config_.queue_slots; }
  void wait() noexcept;

  const PipelineConfig& config_;
  RigEngine& engine_;
  PipelineQueues& queues_;
  CaptureGrouping grouping_;
  RigTests tests_;
  std::uint64_t taken_ = 0, released_ = 0;  // turns
  std::vector<bool> is_finished_;           // by turns
  std::vector<std::uint64_t> ends_;         // turns of ends of streams, whose frames may still wait
  // Of the test's results: the complement of its first frame's, so that it is no sender's. None after the test's end.
  std::optional<std::uint64_t> session_;
  std::uint64_t captures_ = 0;
  std::atomic<std::uint64_t> current_frame_{0}, rounds_{0};
  SideBySide threads_;
};

}  // namespace lbea::tool
