#pragma once

#include <chrono>
#include <cstdint>

namespace lbea {

/// Wall time between laps. On Linux the steady clock is read in user space: no system call.
class Stopwatch {
 public:
  std::uint32_t lap() noexcept {
    const auto now = std::chrono::steady_clock::now();
    const auto elapsed = std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_).count();
    last_ = now;
    return static_cast<std::uint32_t>(elapsed);
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace lbea
