#include "tools/replay/pace.hpp"

#include <algorithm>
#include <cstdio>
#include <thread>

#include <poll.h>
#include <unistd.h>

namespace lbea::tool {
namespace {
constexpr std::chrono::milliseconds stop_interval{50};  // how long a stop may go unnoticed
}

bool Pace::wait_for(std::int64_t log_time_ns) {
  if (config_.steps) return wait_for_line();
  if (config_.speed == 0) return !stop_();
  if (!begun_) {
    begun_ = true;
    begin_ = Clock::now();
    first_ns_ = log_time_ns;
  }
  const double offset_ns = static_cast<double>(log_time_ns - first_ns_) / config_.speed;
  const auto due = begin_ + std::chrono::nanoseconds(static_cast<std::int64_t>(offset_ns));
  while (!stop_() && Clock::now() < due) std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
  worst_ = std::max(worst_, std::chrono::nanoseconds(Clock::now() - due));
  return !stop_();
}

bool Pace::wait_for_line() const {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!stop_()) {
    if (::poll(&input, 1, static_cast<int>(stop_interval.count())) <= 0) continue;
    char letter = 0;
    do {
      if (::read(STDIN_FILENO, &letter, 1) != 1) return false;
    } while (letter != '\n');
    return true;
  }
  return false;
}

}  // namespace lbea::tool
