// A signal over time, and its values at equidistant times.
#pragma once

#include <span>
#include <vector>

namespace lbea::tool {

struct Signal {
  std::vector<double> times_s, values;  // of equal size; times increase; no value is NaN or infinite

  [[nodiscard]] bool empty() const noexcept { return times_s.empty(); }
  [[nodiscard]] double begin_s() const noexcept { return times_s.front(); }
  [[nodiscard]] double end_s() const noexcept { return times_s.back(); }
};

/// Without the values that are not finite. `times_s` and `values` are of equal size; a time that is not after all
/// earlier ones is left out.
[[nodiscard]] Signal known_part(std::span<const double> times_s, std::span<const double> values);

/// Equidistant times.
struct TimeGrid {
  double first_s = 0, interval_s = 0;
  std::size_t size = 0;
  [[nodiscard]] double at(std::size_t i) const noexcept { return first_s + static_cast<double>(i) * interval_s; }
};

/// Times from begin_s on, at most end_s, `interval_s` apart; empty if begin_s > end_s.
[[nodiscard]] TimeGrid grid_within(double begin_s, double end_s, double interval_s) noexcept;

/// Linear between the signal's values, constant before the first and after the last. The signal must not be empty.
[[nodiscard]] std::vector<double> resampled(const Signal& signal, const TimeGrid& grid);

}  // namespace lbea::tool
