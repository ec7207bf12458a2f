// Equidistant values of frames that may be late, missing or without a value.
#include "tools/report/content/channels/channel_export.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// Without the digits that sums of times have lost.
double rounded(double value, double per_second) { return std::round(value * per_second) / per_second; }

double median_interval(std::span<const double> times_s) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times_s.size(); ++i) intervals.push_back(times_s[i] - times_s[i - 1]);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::ranges::nth_element(intervals, middle);
  return *middle;
}

/// From the first to the last time.
TimeGrid grid_of(std::span<const double> times_s) {
  constexpr double least_interval_s = 1e-9, most_values = 10;  // per time
  const double duration_s = times_s.back() - times_s.front();
  const double interval_s = std::max(
      {median_interval(times_s), least_interval_s, duration_s / (most_values * static_cast<double>(times_s.size()))});
  const double intervals = std::max(1.0, std::round(duration_s / interval_s));
  return {times_s.front(), duration_s / intervals, static_cast<std::size_t>(intervals) + 1};
}

/// Place of each time in the grid; empty when one lies between two, or two have the same.
std::vector<std::size_t> places_in(const TimeGrid& grid, std::span<const double> times_s) {
  constexpr double tolerance = 1e-4;  // of an interval: stamps are whole nanoseconds
  std::vector<std::size_t> places;
  for (const double time_s : times_s) {
    const double place = (time_s - grid.first_s) / grid.interval_s, nearest = std::round(place);
    const bool is_next = places.empty() || nearest > static_cast<double>(places.back());
    if (std::abs(place - nearest) > tolerance || !is_next) return {};
    places.push_back(static_cast<std::size_t>(nearest));
  }
  return places;
}

std::vector<double> interpolated(const TimeGrid& grid, std::span<const double> times_s,
                                 std::span<const double> values) {
  constexpr double widest = 1.5;  // intervals
  std::vector<double> result(grid.size, not_known);
  std::size_t next = 1;
  for (std::size_t i = 0; i < grid.size; ++i) {
    const double time_s = std::min(grid.at(i), times_s.back());
    while (next + 1 < times_s.size() && times_s[next] < time_s) ++next;
    const double before_s = times_s[next - 1], share = (time_s - before_s) / (times_s[next] - before_s);
    if (share == 0 || share == 1)
      result[i] = values[share == 0 ? next - 1 : next];
    else if (times_s[next] - before_s < widest * grid.interval_s)
      result[i] = std::lerp(values[next - 1], values[next], share);
  }
  return result;
}

}  // namespace

EvenSamples evenly_sampled(std::span<const double> times_s, std::span<const double> values) {
  constexpr double lone_interval_s = 1e-3, nanoseconds = 1e9, picoseconds = 1e12;  // per second
  if (times_s.empty()) return {};
  EvenSamples samples{rounded(times_s.front(), nanoseconds), lone_interval_s, {values.begin(), values.end()}};
  if (times_s.size() == 1) return samples;
  const TimeGrid grid = grid_of(times_s);
  samples.interval_s = rounded(grid.interval_s, picoseconds);
  const std::vector<std::size_t> places = places_in(grid, times_s);
  if (places.empty()) {
    samples.values = interpolated(grid, times_s, values);
    return samples;
  }
  samples.values.assign(grid.size, not_known);
  for (std::size_t i = 0; i < places.size(); ++i) samples.values[places[i]] = values[i];
  return samples;
}

}  // namespace lbea::tool
