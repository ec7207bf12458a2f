#include "tools/shared/rating/objective_rating.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace lbea::tool {
namespace {

// Constants of ISO/TS 18571.
constexpr double inner_corridor = 0.05, outer_corridor = 0.5;  // a0, b0
constexpr std::size_t parts_of_shift = 5;                      // 1 / eps_P
constexpr double most_magnitude_error = 0.5;                   // eps_M
constexpr double most_slope_error = 2;                         // eps_S
constexpr double corridor_weight = 0.4, weight = 0.2;

double magnitude_of(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

double sum_of_magnitudes(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += std::abs(value);
  return sum;
}

double sum_of_differences(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum;
}

/// 1 without an error, linearly to 0 at `most`; relative to nothing, every error is too large.
double score_of(double error, double scale, double most) {
  if (error == 0) return 1;
  return scale > 0 ? std::clamp((most - error / scale) / most, 0.0, 1.0) : 0;
}

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Of Pearson; -infinity for values without variation.
double correlation(const RatedPair& pair) {
  const double r_mean = mean_of(pair.reference), a_mean = mean_of(pair.analyzed);
  double both = 0, r_squares = 0, a_squares = 0;
  for (std::size_t i = 0; i < pair.reference.size(); ++i) {
    const double r = pair.reference[i] - r_mean, a = pair.analyzed[i] - a_mean;
    both += r * a;
    r_squares += r * r;
    a_squares += a * a;
  }
  const double scale = std::sqrt(r_squares) * std::sqrt(a_squares);
  return scale > 0 ? both / scale : -std::numeric_limits<double>::infinity();
}

void check(const RatedPair& pair) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (pair.reference.size() != pair.analyzed.size())
    throw Error(Status::bad_input, "signals of different sizes cannot be rated");
  if (pair.reference.size() < least_rated_values)
    throw Error(Status::bad_input,
                "a signal of fewer than " + std::to_string(least_rated_values) + " values cannot be rated");
  if (!std::ranges::all_of(pair.reference, is_finite) || !std::ranges::all_of(pair.analyzed, is_finite))
    throw Error(Status::bad_input, "a signal with a value that is not finite cannot be rated");
}

}  // namespace

double corridor_score(const RatedPair& pair) {
  const double scale = magnitude_of(pair.reference);
  const double inner = inner_corridor * scale, outer = outer_corridor * scale;
  double sum = 0;
  for (std::size_t i = 0; i < pair.reference.size(); ++i) {
    const double difference = std::abs(pair.reference[i] - pair.analyzed[i]);
    if (difference == 0 || difference < inner) {
      sum += 1;
    } else if (difference < outer) {
      const double score = (outer - difference) / (outer - inner);
      sum += score * score;
    }
  }
  return sum / static_cast<double>(pair.reference.size());
}

RatedPair without_shift(const RatedPair& pair, PhaseShift shift) noexcept {
  const auto by = static_cast<std::size_t>(std::abs(shift.values));
  const std::size_t size = pair.reference.size() - by;
  if (shift.values >= 0) return {pair.reference.first(size), pair.analyzed.last(size)};
  return {pair.reference.last(size), pair.analyzed.first(size)};
}

PhaseShift phase_shift(const RatedPair& pair) {
  constexpr double rounding = 1e-12;  // parts of straight lines correlate equally well
  const auto most = static_cast<std::ptrdiff_t>(pair.reference.size() / parts_of_shift);
  PhaseShift best;
  double best_correlation = correlation(pair);
  for (std::ptrdiff_t by = 1; by <= most; ++by)
    for (const PhaseShift shift : {PhaseShift{by}, PhaseShift{-by}})
      if (const double now = correlation(without_shift(pair, shift)); now > best_correlation + rounding) {
        best = shift;
        best_correlation = now;
      }
  return best;
}

double phase_score(PhaseShift shift, std::size_t size) noexcept {
  const double most = static_cast<double>(size) / double{parts_of_shift};
  return std::max(0.0, (most - static_cast<double>(std::abs(shift.values))) / most);
}

double magnitude_score(const RatedPair& pair) {
  double error = 0, scale = 0;
  for (const JoinedPlaces& places : warped(pair)) {
    error += std::abs(pair.analyzed[places.analyzed] - pair.reference[places.reference]);
    scale += std::abs(pair.reference[places.reference]);
  }
  return score_of(error, scale, most_magnitude_error);
}

std::vector<double> smoothed_slopes(std::span<const double> values) {
  constexpr std::size_t reach = 4;  // on either side; less near the ends
  const std::size_t size = values.size(), last = size - 1;
  std::vector<double> slopes(size), smoothed(size);
  for (std::size_t i = 1; i < last; ++i) slopes[i] = (values[i + 1] - values[i - 1]) / 2;
  slopes[0] = values[1] - values[0];
  slopes[last] = values[last] - values[last - 1];
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t around = std::min({reach, i, last - i});
    smoothed[i] = mean_of(std::span(slopes).subspan(i - around, 2 * around + 1));
  }
  return smoothed;
}

double slope_score(const RatedPair& pair) {
  const std::vector<double> reference = smoothed_slopes(pair.reference), analyzed = smoothed_slopes(pair.analyzed);
  return score_of(sum_of_differences(reference, analyzed), sum_of_magnitudes(reference), most_slope_error);
}

ObjectiveRating rate(const RatedPair& pair) {
  check(pair);
  ObjectiveRating rating;
  rating.corridor = corridor_score(pair);
  rating.shift = phase_shift(pair);
  rating.phase = phase_score(rating.shift, pair.reference.size());
  const RatedPair aligned = without_shift(pair, rating.shift);
  rating.magnitude = magnitude_score(aligned);
  rating.slope = slope_score(aligned);
  rating.overall = corridor_weight * rating.corridor + weight * (rating.phase + rating.magnitude + rating.slope);
  return rating;
}

std::string_view grade_of(double overall) noexcept {
  constexpr double excellent = 0.94, good = 0.80, fair = 0.58;
  return overall > excellent ? "excellent" : overall > good ? "good" : overall > fair ? "fair" : "poor";
}

}  // namespace lbea::tool
