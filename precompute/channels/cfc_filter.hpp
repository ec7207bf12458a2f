// Derivatives of a run's history, and the filter of the channel frequency classes (CFC) of SAE J211-1.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lbea::bake {

/// States that a derivative needs.
inline constexpr std::size_t derivative_states = 5;

/// The derivative of this order (0 to 2) at the times `at`, by the polynomial through the five states around each:
/// exact for motions up to the fourth power of time, also at the ends. times: strictly ascending, at least five.
[[nodiscard]] std::vector<double> derivative(std::span<const double> times, std::span<const double> values,
                                             std::span<const double> at, std::size_t order);

/// The Butterworth filter of SAE J211-1, annex C: two poles, once forward and once backward, so that the phase is zero.
/// values: evenly sampled. Before both ends the deviation from the straight line between the first and the last value
/// continues as its point reflection: a linear course passes unchanged, and the first and the last value stay.
[[nodiscard]] std::vector<double> cfc_filtered(std::span<const double> values, double interval_s, std::uint32_t cfc);

/// SAE J211-1 asks for ten samples per second for each Hz of the class.
[[nodiscard]] constexpr double least_rate(std::uint32_t cfc) noexcept { return 10.0 * cfc; }

/// cfc_filtered() of values at any times: resampled to as many even ones before, and back afterwards.
[[nodiscard]] std::vector<double> cfc_filtered_at(std::span<const double> times, std::span<const double> values,
                                                  std::uint32_t cfc);

}  // namespace lbea::bake
