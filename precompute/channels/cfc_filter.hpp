// Derivatives of a run's history, and the filter of the channel frequency classes (CFC) of SAE J211-1.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lbea::bake {

/// States that a derivative needs.
inline constexpr std::size_t derivative_states = 5;

/// The values (order 0) or first derivatives (order 1) at the times `at`, by the polynomial through the nearest state
/// and two on either side: exact for motions up to the fourth power of time. Next to an end it uses one state on either
/// side. At an end the derivative is the slope between the last two states: a polynomial extrapolated to an end has the
/// wrong sign where the motion begins with an impact. times: strictly ascending, at least five.
[[nodiscard]] std::vector<double> derivative(std::span<const double> times, std::span<const double> values,
                                             std::span<const double> at, std::size_t order);

/// The Butterworth filter of SAE J211-1, annex C: two poles, once forward and once backward, so that the phase is zero.
/// values: evenly sampled. Before both ends the deviation from the straight line between the first and the last value
/// continues as its point reflection: a linear course passes unchanged, and the first and the last value stay.
[[nodiscard]] std::vector<double> cfc_filtered(std::span<const double> values, double interval_s, std::uint32_t cfc);

/// Half a period of the frequency at which the class has -3 dB, s: of shorter records the filter leaves a straight
/// line.
[[nodiscard]] constexpr double least_record(std::uint32_t cfc) noexcept { return 0.3 / cfc; }

/// SAE J211-1 asks for ten samples per second for each Hz of the class.
[[nodiscard]] constexpr double least_rate(std::uint32_t cfc) noexcept { return 10.0 * cfc; }

/// cfc_filtered() of values at any times: resampled to as many even ones before, and back afterwards.
[[nodiscard]] std::vector<double> cfc_filtered_at(std::span<const double> times, std::span<const double> values,
                                                  std::uint32_t cfc);

}  // namespace lbea::bake
