// The objective rating of ISO/TS 18571 (clauses as of 2014): how well an analyzed signal, of a simulation, agrees with
// a reference signal, of a test. Every score is between 0 and 1.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace lbea::tool {

/// Clause 5: of both signals, over the interval of evaluation.
inline constexpr double rating_frequency_hz = 1e4, rating_interval_s = 1 / rating_frequency_hz;
/// That the smoothed slope of clause 6.3 needs.
inline constexpr std::size_t least_rated_values = 9;

/// Values at the same equidistant times. All functions below need at least least_rated_values finite values in each,
/// and as many in both.
struct RatedPair {
  std::span<const double> reference, analyzed;
};

/// Clause 6.2: mean over the values of 1 within 5 % of the reference's largest magnitude, of 0 beyond 50 %, and
/// quadratic in between. A reference of zeros: the share of equal values.
[[nodiscard]] double corridor_score(const RatedPair& pair);

/// How far the analyzed signal comes after the reference, in values; negative: before.
struct PhaseShift {
  std::ptrdiff_t values = 0;
};
/// Clause 6.3: the shift by at most a fifth of the signal for which the parts that both have correlate best; of equally
/// good ones the smallest, then the later one. Parts without variation do not correlate.
[[nodiscard]] PhaseShift phase_shift(const RatedPair& pair);
/// Clause 6.3: 1 without a shift, linearly to 0 at a fifth of `size` values.
[[nodiscard]] double phase_score(PhaseShift shift, std::size_t size) noexcept;
/// The parts that both have after the analyzed signal is moved back by `shift`.
[[nodiscard]] RatedPair without_shift(const RatedPair& pair, PhaseShift shift) noexcept;

/// Clause 6.3: the pairs (reference, analyzed) of places that dynamic time warping joins, from the first to the last:
/// least sum of squared differences, places less than a tenth of the signals (rounded up) apart.
struct JoinedPlaces {
  std::size_t reference = 0, analyzed = 0;
};
[[nodiscard]] std::vector<JoinedPlaces> warped(const RatedPair& pair);
/// Clause 6.3, of a pair without shift: sum of differences over sum of the reference's magnitudes, both warped; 1 for
/// 0, linearly to 0 for 0.5. A reference of zeros: 1 if equal, else 0.
[[nodiscard]] double magnitude_score(const RatedPair& pair);

/// Clause 6.3: central differences per interval, averaged over up to 9 values.
[[nodiscard]] std::vector<double> smoothed_slopes(std::span<const double> values);
/// Clause 6.3, of a pair without shift: sum of differences of the slopes over the sum of the reference's, 1 for 0,
/// linearly to 0 for 2. A constant reference: 1 if the slopes are equal, else 0.
[[nodiscard]] double slope_score(const RatedPair& pair);

struct ObjectiveRating {
  double overall = 0;  // R, clause 6.1: 0.4 corridor + 0.2 (phase + magnitude + slope)
  double corridor = 0, phase = 0, magnitude = 0, slope = 0;  // Z, EP, EM, ES
  PhaseShift shift;
};

/// Throws Error{bad_input} for sizes that differ, fewer values than least_rated_values, and values that are not finite.
/// Time and memory rise with the square of the size: of 10,000 values about 0.3 s and 20 MB.
[[nodiscard]] ObjectiveRating rate(const RatedPair& pair);

/// Meaning of the overall rating: "excellent" above 0.94, "good" above 0.80, "fair" above 0.58, else "poor".
[[nodiscard]] std::string_view grade_of(double overall) noexcept;

}  // namespace lbea::tool
