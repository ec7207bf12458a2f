// The matching threads: turn queued frames into outcomes, in their order.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"

#ifdef _WIN32
#include <condition_variable>
#include <mutex>
#endif

namespace lbea::tool {

/// Lets threads that work side by side go on one after the other, by their numbers.
class Turns {
 public:
#ifdef _WIN32  // see barrier.hpp
  void wait_for(std::uint64_t turn) const noexcept {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ended_ == turn; });
  }
#else
  void wait_for(std::uint64_t turn) const noexcept {
    for (std::uint64_t ended = ended_; ended != turn; ended = ended_) ended_.wait(ended);
  }
#endif
  /// Only by the thread whose turn it is.
  void end_turn() noexcept {
#ifdef _WIN32
    const std::lock_guard lock(mutex_);
    ++ended_;
    changed_.notify_all();
#else
    ++ended_;
    ended_.notify_all();
#endif
  }
  [[nodiscard]] std::uint64_t ended() const noexcept { return ended_; }

 private:
  std::atomic<std::uint64_t> ended_{0};
#ifdef _WIN32
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
#endif
};

/// Each thread takes the oldest frame that no other has taken, and matches it beside theirs unless its result depends
/// on the frames before it. The thread with the oldest frame finishes it and those after it that are matched already:
/// outcomes, counters and tests are those of a single thread, and no thread waits for a slower one.
class FrameMatcher {
 public:
  FrameMatcher(const PipelineConfig& config, MatchEngine& engine, PipelineQueues& queues)
      : on_start_(config.on_matching_thread), engine_(engine), queues_(queues), in_work_(queues.frames.capacity()) {}
  /// One thread per matcher: runs until the queue of frames is closed and empty.
  void run(std::uint32_t matcher) noexcept;
  // Any thread:
  /// The id of the oldest frame that is being matched, or of the one that was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept;
  /// Rises while no frame is being matched, and with each outcome.
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  struct Work {
    FrameSlot* slot = nullptr;
    std::uint64_t turn = 0;
    std::uint32_t queue_ns = 0;
  };
  /// Waits for a frame. False when there will be none.
  [[nodiscard]] bool take(Work& work) noexcept;
  struct InWork {  // a frame that is taken and not finished
    std::atomic<std::uint64_t> id{0};
    bool is_matched = false;  // guarded by finishing_
  };
  [[nodiscard]] InWork& in_work(std::uint64_t turn) noexcept { return in_work_[turn % in_work_.size()]; }
  void match(const Work& work, std::uint32_t matcher) noexcept;
  void finish_matched(std::uint64_t turn) noexcept;
  void finish_oldest() noexcept;
  void fill(Outcome& outcome, const Work& work) noexcept;
  void begin_test_of(const FrameSlot& slot) noexcept;

  std::function<void(std::uint32_t)> on_start_;  // may be empty
  MatchEngine& engine_;
  PipelineQueues& queues_;
  std::mutex taking_, finishing_;
  std::atomic<std::uint64_t> taken_{0};
  Turns turns_;
  std::vector<InWork> in_work_;           // by turns
  std::optional<std::uint64_t> session_;  // of the test; none before its first frame
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
