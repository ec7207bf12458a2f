#include "tools/shared/rating/signal.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {

Signal known_part(std::span<const double> times_s, std::span<const double> values) {
  Signal signal;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (!std::isfinite(values[i]) || !std::isfinite(times_s[i])) continue;
    if (!signal.empty() && times_s[i] <= signal.end_s()) continue;
    signal.times_s.push_back(times_s[i]);
    signal.values.push_back(values[i]);
  }
  return signal;
}

TimeGrid grid_within(double begin_s, double end_s, double interval_s) noexcept {
  constexpr double rounding = 1e-6;  // of an interval: the last time is not lost
  const double intervals = (end_s - begin_s) / interval_s;
  if (!(intervals >= 0)) return {begin_s, interval_s, 0};
  return {begin_s, interval_s, static_cast<std::size_t>(std::floor(intervals + rounding)) + 1};
}

std::vector<double> resampled(const Signal& signal, const TimeGrid& grid) {
  std::vector<double> values(grid.size);
  // Of the signal's first time that is not before the grid's.
  auto next = static_cast<std::size_t>(std::ranges::lower_bound(signal.times_s, grid.first_s) - signal.times_s.begin());
  for (std::size_t i = 0; i < grid.size; ++i) {
    const double time_s = grid.at(i);
    while (next < signal.times_s.size() && signal.times_s[next] < time_s) ++next;
    if (next == 0 || next == signal.times_s.size()) {
      values[i] = next == 0 ? signal.values.front() : signal.values.back();
      continue;
    }
    const double before_s = signal.times_s[next - 1];
    values[i] = std::lerp(signal.values[next - 1], signal.values[next],
                          (time_s - before_s) / (signal.times_s[next] - before_s));
  }
  return values;
}

}  // namespace lbea::tool
