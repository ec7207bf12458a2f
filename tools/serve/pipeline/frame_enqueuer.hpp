// The pipeline's intake: puts received frames into the matcher's queue and rejections into the publisher's.
#pragma once

#include "tools/serve/pipeline/pipeline_queues.hpp"

namespace lbea::tool {

/// Allows so many events per second, and as many at once after a pause.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RateLimit(double per_second) : per_second_(per_second), left_(per_second) {}
  /// Whether one more is allowed now; counts it.
  [[nodiscard]] bool allows(Clock::time_point now) noexcept;

 private:
  double per_second_, left_;
  Clock::time_point last_{};
};

/// The receiving thread's. A capture that cannot be matched still gets a result; without room for it, the capture is
/// counted as unannounced.
class FrameEnqueuer final : public IntakeSink {
 public:
  FrameEnqueuer(const PipelineConfig& config, PipelineQueues& queues)
      : unidentified_limit_(config.unidentified_results_per_second), observer_(config.observer), queues_(queues) {}
  void on_frame(const ReceivedFrame& frame) noexcept override;
  void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                 std::int64_t receive_ns) noexcept override;
  void on_control(const wire::Control& control) noexcept override;

 private:
  void enqueue(FrameSlot& slot, const ReceivedFrame& frame) noexcept;
  void reject(wire::WireStatus status, const ReceivedFrame& frame) noexcept;
  void push_rejection(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept;

  RateLimit unidentified_limit_;
  RunObserver* observer_;  // optional
  PipelineQueues& queues_;
};

}  // namespace lbea::tool
