// When each recorded frame is sent.
#pragma once

#include <chrono>
#include <cstdint>

namespace lbea::tool {

struct PaceOptions {
  double speed = 1;                  // relative to the recording
  bool fast = false, steps = false;  // as fast as possible; one frame per line on standard input. Both wait for room.
  [[nodiscard]] bool waits_for_room() const noexcept { return fast || steps; }
};

class Pace {
 public:
  explicit Pace(const PaceOptions& options) : options_(options) {}
  /// Waits until a frame received at `log_time_ns` is due, relative to the first call. False when the replay is stopped
  /// or standard input has ended.
  bool wait_for(std::int64_t log_time_ns);
  /// The next frame is due at once; later ones are relative to it.
  void restart() { begun_ = false; }
  /// The largest delay of a frame.
  [[nodiscard]] double worst_ms() const noexcept { return static_cast<double>(worst_.count()) * 1e-6; }

  static constexpr std::chrono::milliseconds stop_interval{50};  // longest delay of a stop

 private:
  using Clock = std::chrono::steady_clock;
  void begin_at(std::int64_t log_time_ns);

  const PaceOptions& options_;
  bool begun_ = false;
  Clock::time_point begin_{};
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  std::chrono::nanoseconds worst_{0};
};

}  // namespace lbea::tool
