// How often something may happen: so many times a second, with as many at once when it was quiet.
#pragma once

#include <algorithm>
#include <chrono>

namespace lbea::tool {

class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RateLimit(double per_second) : per_second_(per_second), left_(per_second) {}
  /// Whether one more is allowed now; takes it.
  [[nodiscard]] bool allows(Clock::time_point now) noexcept {
    const double seconds = std::chrono::duration<double>(now - last_).count();
    left_ = std::min(per_second_, left_ + std::max(0.0, seconds) * per_second_);
    last_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  double per_second_, left_;
  Clock::time_point last_{};
};

}  // namespace lbea::tool
