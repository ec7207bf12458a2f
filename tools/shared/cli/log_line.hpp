// A kind of log line that is written at most once a second, however often there is reason to.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

namespace lbea::tool {

class LogLine {
 public:
  /// Whether to write it now for these `times` that there was reason to; else the next one says how often it was not.
  [[nodiscard]] bool may_speak(std::uint64_t times = 1) {
    const auto now = Clock::now();
    if (last_ != Clock::time_point{} && now - last_ < interval) {
      untold_ += times;
      return false;
    }
    last_ = now;
    return true;
  }
  /// " (and 7 more since the last such line)"; empty when there are none.
  [[nodiscard]] std::string untold_text() {
    const std::uint64_t untold = std::exchange(untold_, 0);
    return untold == 0 ? std::string() : " (and " + std::to_string(untold) + " more since the last such line)";
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto interval = std::chrono::seconds(1);
  Clock::time_point last_{};
  std::uint64_t untold_ = 0;
};

}  // namespace lbea::tool
