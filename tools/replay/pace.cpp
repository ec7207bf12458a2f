#include "tools/replay/pace.hpp"

#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"

#include <algorithm>
#include <thread>

#include <poll.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

constexpr double longest_disorder_ns = 1e9, long_pause_ns = 1e10;
constexpr double latest_ns = 4e18;  // 127 years; the clock would overflow far beyond it

bool wait_for_line() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (stop_requested == 0) {
    if (::poll(&input, 1, static_cast<int>(Pace::stop_interval.count())) <= 0) continue;
    char letter = 0;
    do {
      if (::read(STDIN_FILENO, &letter, 1) != 1) return false;
    } while (letter != '\n');
    return true;
  }
  return false;
}

}  // namespace

bool Pace::wait_for(std::int64_t log_time_ns) {
  if (options_.steps) return wait_for_line();
  if (options_.fast) return stop_requested == 0;
  // Older recordings may contain a step of the clock. After a step backwards the pace starts anew.
  const double pause_ns = difference_ns(log_time_ns, last_ns_);
  if (!begun_ || pause_ns < -longest_disorder_ns) {
    begin_at(log_time_ns);
  } else if (pause_ns > long_pause_ns) {
    log_info("no frame for {:.0f} s of the recording; --fast does not wait", 1e-9 * pause_ns);
  }
  last_ns_ = log_time_ns;
  const double offset_ns = std::min(difference_ns(log_time_ns, first_ns_) / options_.speed, latest_ns);
  const auto due = begin_ + std::chrono::nanoseconds(static_cast<std::int64_t>(offset_ns));
  while (stop_requested == 0 && Clock::now() < due)
    std::this_thread::sleep_until(std::min(due, Clock::now() + stop_interval));
  worst_ = std::max(worst_, std::chrono::nanoseconds(Clock::now() - due));
  return stop_requested == 0;
}

void Pace::begin_at(std::int64_t log_time_ns) {
  begun_ = true;
  begin_ = Clock::now();
  first_ns_ = log_time_ns;
}

}  // namespace lbea::tool
