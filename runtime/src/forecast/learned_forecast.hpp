// What the bake learned about how tests end: regressions from the shapes seen so far to the final shape and to the
// parameters of the run.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <array>
#include <span>

namespace lbea {

/// Node k of the forecast is at k tenths of a simulation's duration after the impact. Its features are the deviations
/// of the shapes at nodes 1 to k from the runs' mean shape. At node 0 nothing has been seen.
struct LearnedForecast {
  static constexpr std::size_t nodes = 10, means_per_node = 4, most_components = 64, most_runs = 512;
  static constexpr std::size_t shape_scores = ShapeRegression::shape_scores, features = nodes * shape_scores;
  static_assert(features == format::padded(features) && most_components == format::padded(most_components));

  std::span<const double> numbers;  // (1 + nodes) x (1 + 2 P): error_90 (0: not learned); per parameter R^2, 90 % bound
  std::span<const float> means;     // (1 + nodes means_per_node) x shape_scores: the runs' mean shapes over time
  std::span<const float> components;  // nodes x most_components x features: principal components of deviations
  std::span<const float> runs;        // nodes x m x most_components: weights of the runs, per component
  std::span<const float> parameters;  // nodes x P x most_components: the same of the parameters

  /// Of the runs of an ensemble, those that the final shape is composed of.
  [[nodiscard]] static std::uint32_t trained_runs(std::uint32_t simulations) noexcept {
    return std::min<std::uint32_t>(simulations, most_runs);
  }
  [[nodiscard]] static std::uint32_t trained_run(std::size_t i, std::uint32_t simulations) noexcept {
    return format::landmark_vertex(i, trained_runs(simulations), simulations);
  }
};

/// Times of the nodes, in the time of the samples.
struct ForecastTimes {
  double impact_s = 0, duration_s = 0;
  /// times: of all samples, at least one.
  explicit ForecastTimes(std::span<const double> times) noexcept {
    const auto [first, last] = std::ranges::minmax(times);
    impact_s = first;
    duration_s = last - first;
  }
  [[nodiscard]] double at(double node) const noexcept {
    return impact_s + duration_s * node / static_cast<double>(LearnedForecast::nodes);
  }
};

/// Reads sections 0x800C to 0x8010. Null when the file has none, or nothing was learned. Throws Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const LearnedForecast> read_forecast(const SectionReader& sections,
                                                                   const format::Info& info);

}  // namespace lbea
