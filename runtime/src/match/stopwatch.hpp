// Times of the stages of a frame.
#pragma once

#include <chrono>
#include <cstdint>
#include <utility>

namespace lbea {

/// Time since the last lap or the construction. On Linux the steady clock is read in user space: no system call.
class Stopwatch {
 public:
  std::uint32_t lap_ns() noexcept {
    const auto now = std::chrono::steady_clock::now();
    return static_cast<std::uint32_t>((now - std::exchange(last_, now)) / std::chrono::nanoseconds(1));
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace lbea
