// When the frames of a replay are due.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

namespace lbea::tool {

struct PaceConfig {
  double speed = 1;    // times as fast as recorded; 0: as fast as it goes
  bool steps = false;  // one frame per line on standard input
};

class Pace {
 public:
  Pace(const PaceConfig& config, std::function<bool()> stop) : config_(config), stop_(std::move(stop)) {}
  /// Waits until a frame that was received at `log_time_ns` is due, counted from the first one asked for. False
  /// when `stop` says so or standard input has ended.
  bool wait_for(std::int64_t log_time_ns);
  /// The next frame is due at once, and the ones behind it counted from there.
  void restart() { begun_ = false; }
  /// How late the latest frame was handed out.
  [[nodiscard]] std::chrono::nanoseconds worst_lateness() const noexcept { return worst_; }

 private:
  using Clock = std::chrono::steady_clock;
  bool wait_for_line() const;
  PaceConfig config_;
  std::function<bool()> stop_;
  bool begun_ = false;
  Clock::time_point begin_{};
  std::int64_t first_ns_ = 0;
  std::chrono::nanoseconds worst_{0};
};

}  // namespace lbea::tool
