// The matching thread: one frame after another, each to its outcome.
#pragma once

#include "tools/serve/handover.hpp"
#include "tools/shared/matching/match_engine.hpp"

#include <atomic>
#include <functional>

namespace lbea::tool {

class FrameMatcher {
 public:
  FrameMatcher(const PipelineConfig& config, MatchEngine& engine, Handover& handover)
      : at_start_(config.on_matching_thread), engine_(engine), handover_(handover) {}
  /// Until the receiver is done and its frames are matched.
  void run() noexcept;
  // Any thread:
  /// The id of the frame that is worked on, or was last.
  [[nodiscard]] std::uint64_t frame_in_work() const noexcept { return frame_in_work_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  void match(FrameSlot& slot) noexcept;
  void fill(Outcome& outcome, FrameSlot& slot) noexcept;

  std::function<void()> at_start_;  // may be empty
  MatchEngine& engine_;
  Handover& handover_;
  std::uint64_t session_ = 0;  // of the latest frame
  std::atomic<std::uint64_t> frame_in_work_{0};
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
