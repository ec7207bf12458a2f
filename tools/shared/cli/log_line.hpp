// A log line that is written at most once a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

namespace lbea::tool {

class LogLine {
 public:
  /// Whether to write the line now, for `times` occurrences. Otherwise they are counted for the next line.
  [[nodiscard]] bool is_due(std::uint64_t times = 1) {
    const auto now = Clock::now();
    if (last_ != Clock::time_point{} && now - last_ < interval) {
      suppressed_ += times;
      return false;
    }
    last_ = now;
    return true;
  }
  /// " (and 7 more since the last such line)"; empty when there are none.
  [[nodiscard]] std::string suppressed_text() {
    const std::uint64_t suppressed = std::exchange(suppressed_, 0);
    return suppressed == 0 ? std::string() : " (and " + std::to_string(suppressed) + " more since the last such line)";
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto interval = std::chrono::seconds(1);
  Clock::time_point last_{};
  std::uint64_t suppressed_ = 0;
};

}  // namespace lbea::tool
