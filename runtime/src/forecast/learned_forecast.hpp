// What the bake learned about how tests end: regressions from the shapes seen so far to the final shape and to the
// parameters of the run.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <array>
#include <span>

namespace lbea {

/// The nodes `first` to `last` of a forecast, both at least 1: what has been seen of a test.
struct ForecastWindow {
  static constexpr std::size_t nodes = 10, count = nodes * (nodes + 1) / 2;
  std::size_t first = 1, last = 1;

  [[nodiscard]] constexpr std::size_t size() const noexcept { return last - first + 1; }
  /// From 0 to count - 1.
  [[nodiscard]] constexpr std::size_t number() const noexcept {
    return (first - 1) * (2 * nodes + 2 - first) / 2 + last - first;
  }
  /// Sum of the sizes of the windows with lower numbers.
  [[nodiscard]] constexpr std::size_t sizes_before() const noexcept {
    std::size_t sum = (size() - 1) * size() / 2;
    for (std::size_t before = 1; before < first; ++before)
      sum += ForecastWindow{before, nodes}.size() * (nodes + 2 - before) / 2;
    return sum;
  }
};

/// Node k of the forecast is at k tenths of a simulation's duration after the impact. The features of a window are the
/// deviations of the shapes at its nodes from the runs' mean shapes. What matters of them are their principal
/// components; a ridge regression on these gives the final shape, and others the parameters.
struct LearnedForecast {
  static constexpr std::size_t nodes = ForecastWindow::nodes, means_per_node = 4, most_components = 64, most_runs = 512;
  static constexpr std::size_t shape_scores = ShapeRegression::shape_scores, features = nodes * shape_scores;
  static constexpr std::size_t kinds = 2;  // of tests: seen completely; with a part hidden
  static constexpr std::size_t all_sizes = ForecastWindow{nodes, nodes}.sizes_before() + 1;
  static_assert(shape_scores == format::padded(shape_scores) && most_components == format::padded(most_components));

  /// kinds x (1 + windows) x (2 + 3 P): error_90 (0: not learned) and ridge of the final shape; per parameter R^2, 90 %
  /// bound, ridge. The first of a kind: nothing has been seen.
  std::span<const double> numbers;
  std::span<const float> means;       // (1 + nodes means_per_node) x shape_scores: the runs' mean shapes over time
  std::span<const float> components;  // windows x most_components x (size shape_scores): of the deviations
  std::span<const float> variances;   // windows x most_components: sums of the runs' squared components
  std::span<const float> runs;        // windows x m x most_components: the runs' components
  std::span<const float> parameters;  // windows x P x most_components: sums of components times parameters
  /// Of the C channels; empty: none, or of a model that was baked before. kinds x (1 + windows) x C x 2 x 2: of a
  /// channel's value at the window's last node, and of its final value, the 90 % bound and the ridge.
  std::span<const double> channel_numbers;
  std::span<const float> channel_products;  // windows x C x 2 x most_components: sums of components times values

  [[nodiscard]] static constexpr std::size_t numbers_per_window(std::size_t parameters) noexcept {
    return 2 + 3 * parameters;
  }
  static constexpr std::size_t values_per_channel = 2, numbers_per_channel = 2 * values_per_channel;
  /// Of the ensemble's runs, those that the final shape is composed of.
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

/// Reads sections 0x8018 to 0x801D, 0x8024 and 0x8025. channels: of the model. Null when the file has none, or nothing
/// was learned. Throws Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const LearnedForecast> read_forecast(const SectionReader& sections,
                                                                   const format::Info& info, std::uint64_t channels);

}  // namespace lbea
