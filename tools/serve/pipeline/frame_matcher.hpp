// The matching thread: turns each queued frame into an outcome.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"

namespace lbea::tool {

class FrameMatcher {
 public:
  FrameMatcher(const PipelineConfig& config, MatchEngine& engine, PipelineQueues& queues)
      : on_start_(config.on_matching_thread), engine_(engine), queues_(queues) {}
  /// Runs until the queue of frames is closed and empty.
  void run() noexcept;
  // Any thread:
  /// The id of the frame that is being matched, or was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept { return current_frame_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  void match(FrameSlot& slot) noexcept;
  void fill(Outcome& outcome, FrameSlot& slot) noexcept;

  std::function<void()> on_start_;  // may be empty
  MatchEngine& engine_;
  PipelineQueues& queues_;
  std::optional<std::uint64_t> session_;  // of the test; none before its first frame
  std::atomic<std::uint64_t> current_frame_{0};
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
