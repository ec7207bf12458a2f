#include "precompute/channels/cfc_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace lbea::bake {
namespace {

constexpr std::size_t most_states = derivative_states;

/// Weights of the values at `x` for the derivative of this order at `at`: the recursion of Fornberg (1988), from
/// polynomials through fewer points to those through more.
std::array<double, most_states> weights(std::span<const double> x, double at, std::size_t order) {
  std::array<std::array<double, most_states>, 2> of{};  // [order][point]
  of[0][0] = 1;
  double before = 1;
  for (std::size_t n = 1; n < x.size(); ++n) {
    double product = 1;
    for (std::size_t i = 0; i < n; ++i) product *= x[n] - x[i];
    for (std::size_t m = 2; m-- > 0;)
      of[m][n] =
          before / product * ((m > 0 ? static_cast<double>(m) * of[m - 1][n - 1] : 0) - (x[n - 1] - at) * of[m][n - 1]);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t m = 2; m-- > 0;)
        of[m][i] = ((x[n] - at) * of[m][i] - (m > 0 ? static_cast<double>(m) * of[m - 1][i] : 0)) / (x[n] - x[i]);
    before = product;
  }
  return of[order];
}

struct States {
  std::size_t first, count;
};

/// As many on either side of the nearest one, at most two; at the ends the last two.
States states_around(std::span<const double> times, double at) {
  const auto after = static_cast<std::size_t>(std::ranges::lower_bound(times, at) - times.begin());
  const std::size_t last = times.size() - 1;
  const std::size_t nearest =
      after > last || (after > 0 && at - times[after - 1] < times[after] - at) ? after - 1 : after;
  const std::size_t reach = std::min({nearest, last - nearest, most_states / 2});
  if (reach > 0) return {nearest - reach, 2 * reach + 1};
  return {nearest == 0 ? 0 : last - 1, 2};
}

/// One direction; zero before the first value.
void filter_forward(std::vector<double>& values, double interval_s, double cfc) {
  const double warped = std::tan(std::numbers::pi * cfc * 2.0775 * interval_s), square = warped * warped;
  const double divisor = 1 + std::numbers::sqrt2 * warped + square;
  const double a = square / divisor, b1 = -2 * (square - 1) / divisor,
               b2 = (-1 + std::numbers::sqrt2 * warped - square) / divisor;
  double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
  for (double& value : values) {
    const double y = a * (value + 2 * x1 + x2) + b1 * y1 + b2 * y2;
    x2 = std::exchange(x1, value);
    y2 = std::exchange(y1, y);
    value = y;
  }
}

/// The odd, periodic continuation of values that begin and end with 0.
double continued(std::span<const double> values, std::ptrdiff_t i) {
  const std::ptrdiff_t last = std::ssize(values) - 1, period = 2 * last;
  const std::ptrdiff_t within = ((i % period) + period) % period;
  return within <= last ? values[static_cast<std::size_t>(within)] : -values[static_cast<std::size_t>(period - within)];
}

std::vector<double> even_times(std::span<const double> times) {
  std::vector<double> even(times.size());
  const double interval = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  for (std::size_t i = 0; i < even.size(); ++i) even[i] = times.front() + interval * static_cast<double>(i);
  return even;
}

}  // namespace

std::vector<double> derivative(std::span<const double> times, std::span<const double> values,
                               std::span<const double> at, std::size_t order) {
  std::vector<double> result;
  for (const double time : at) {
    const auto [first, count] = states_around(times, time);
    const auto w = weights(times.subspan(first, count), time, order);
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += w[i] * values[first + i];
    result.push_back(sum);
  }
  return result;
}

std::vector<double> cfc_filtered(std::span<const double> values, double interval_s, std::uint32_t cfc) {
  constexpr double forgotten = 4;  // periods of the corner frequency, after which less than 1e-7 of a transient is left
  const std::ptrdiff_t count = std::ssize(values);
  const auto padding = static_cast<std::ptrdiff_t>(std::ceil(forgotten / (2.0775 * cfc * interval_s)));
  const auto line = [&](std::ptrdiff_t i) {
    const double share = static_cast<double>(i) / static_cast<double>(count - 1);
    return (1 - share) * values.front() + share * values.back();
  };
  std::vector<double> deviations, padded;
  for (std::ptrdiff_t i = 0; i < count; ++i) deviations.push_back(values[static_cast<std::size_t>(i)] - line(i));
  for (std::ptrdiff_t i = -padding; i < count + padding; ++i) padded.push_back(continued(deviations, i));
  for (int pass = 0; pass < 2; ++pass) {
    filter_forward(padded, interval_s, cfc);
    std::ranges::reverse(padded);
  }
  std::vector<double> filtered;
  for (std::ptrdiff_t i = 0; i < count; ++i)
    filtered.push_back(padded[static_cast<std::size_t>(padding + i)] + line(i));
  return filtered;
}

std::vector<double> cfc_filtered_at(std::span<const double> times, std::span<const double> values, std::uint32_t cfc) {
  const std::vector<double> even = even_times(times);
  const std::vector<double> filtered = cfc_filtered(derivative(times, values, even, 0), even[1] - even[0], cfc);
  return derivative(even, filtered, times, 0);
}

}  // namespace lbea::bake
