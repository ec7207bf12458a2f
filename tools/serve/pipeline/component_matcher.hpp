// With several components: the thread that turns each queued frame into one outcome per component.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"
#include "tools/shared/matching/component_engine.hpp"
#include "tools/shared/matching/side_by_side.hpp"

namespace lbea::tool {

/// One frame after the other, its components side by side. A frame is counted once, with the best status of its
/// components.
class ComponentMatcher {
 public:
  ComponentMatcher(const PipelineConfig& config, ComponentEngine& engine, PipelineQueues& queues);
  /// Runs until the queue of frames is closed and empty.
  void run() noexcept;
  // Any thread:
  /// The id of the frame that is being matched, or of the one that was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept { return current_frame_; }
  /// Rises while nothing is being matched, and with each frame.
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  void match(const FrameSlot& slot) noexcept;
  void end_stream(const FrameSlot& slot) noexcept;
  void begin_test_of(const FrameSlot& slot) noexcept;
  [[nodiscard]] Outcome& claim(const FrameSlot& slot) noexcept;

  const PipelineConfig& config_;
  ComponentEngine& engine_;
  PipelineQueues& queues_;
  std::vector<MatchResult> results_;      // of each component
  std::optional<std::uint64_t> session_;  // of the test; none before its first frame
  std::uint32_t queue_ns_ = 0;            // of the frame
  std::atomic<std::uint64_t> current_frame_{0}, rounds_{0};
  SideBySide threads_;
};

}  // namespace lbea::tool
