// With several rigs: the thread that makes captures of queued frames and turns each into one outcome.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"
#include "tools/shared/matching/side_by_side.hpp"

namespace lbea::tool {

/// Tells when tests begin and end, by the sessions of the rigs' senders. A test ends when one of its senders has ended
/// its stream and none is sending any more. While another one is sending, a sender that restarts or continues is of the
/// same test, unless all the others have restarted too.
class RigTests {
 public:
  explicit RigTests(std::size_t rigs, std::chrono::nanoseconds sender_timeout)
      : timeout_ns_(sender_timeout.count()), rigs_(rigs) {}
  /// Whether a frame would be the first of another test.
  [[nodiscard]] bool begins(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) const noexcept;
  /// The next frame is the first of another test.
  void begin() noexcept;
  /// A frame of the test.
  void add(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept;
  /// The rig's sender has ended its stream.
  void end(std::uint32_t rig, std::uint64_t session) noexcept;
  /// Whether a test has begun and not ended.
  [[nodiscard]] bool is_open() const noexcept { return is_open_; }
  /// Whether the test has ended by now; it is closed then.
  [[nodiscard]] bool closes(std::int64_t now_ns) noexcept;

 private:
  struct Sender {
    std::uint64_t session = 0;
    std::int64_t receive_ns = 0;  // of its latest frame
    bool is_in_test = false, has_ended = false, has_restarted = false;
  };
  [[nodiscard]] bool runs(const Sender& sender, std::int64_t now_ns) const noexcept {
    return sender.is_in_test && !sender.has_ended && now_ns - sender.receive_ns <= timeout_ns_;
  }

  std::int64_t timeout_ns_;
  std::vector<Sender> rigs_;
  bool is_open_ = false;
};

class CaptureMatcher {
 public:
  CaptureMatcher(const PipelineConfig& config, RigEngine& engine, PipelineQueues& queues);
  ~CaptureMatcher();
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
  [[nodiscard]] bool has_end_waiting(std::uint32_t rig) noexcept;
  void finish_ends() noexcept;
  void close_test(std::int64_t now_ns) noexcept;
  void begin_test(const FrameSlot& first) noexcept;
  void publish_end_of_test() noexcept;
  void publish(wire::WireStatus status, const FrameSlot& slot) noexcept;
  void finish(std::uint64_t turn) noexcept;
  [[nodiscard]] FrameSlot& slot_of(const WaitingFrame& frame) noexcept { return *queues_.frames.at(frame.turn); }
  void wait() noexcept;

  const PipelineConfig& config_;
  RigEngine& engine_;
  PipelineQueues& queues_;
  CaptureGrouping grouping_;
  RigTests tests_;
  std::vector<std::int64_t> corrections_ns_;  // per rig, of its clock
  std::uint64_t taken_ = 0, released_ = 0;    // turns
  std::vector<bool> is_finished_;             // by turns
  std::vector<std::uint64_t> ends_;           // turns of ends of streams, whose frames may still wait
  // Of the test's results: the complement of that of the first frame of its first capture, so that it is no sender's.
  // Before: of the first frame that arrived.
  std::uint64_t session_ = 0;
  bool has_capture_ = false;
  std::int64_t matched_receive_ns_ = 0;  // the latest one of matched frames
  std::uint64_t captures_ = 0;
  std::atomic<std::uint64_t> current_frame_{0}, rounds_{0};
  SideBySide threads_;
};

}  // namespace lbea::tool
