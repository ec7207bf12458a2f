#pragma once

#include <chrono>
#include <cstdint>
#include <utility>

namespace lbea {

/// Wall time since the last lap or the construction. On Linux the steady clock is read in user space: no system call.
class Stopwatch {
 public:
  std::uint32_t lap_ns() noexcept {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(lap()).count());
  }
  double lap_s() noexcept { return std::chrono::duration<double>(lap()).count(); }

 private:
  std::chrono::steady_clock::duration lap() noexcept {
    const auto now = std::chrono::steady_clock::now();
    return now - std::exchange(last_, now);
  }

  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace lbea
