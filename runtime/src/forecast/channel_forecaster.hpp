// The channels of a test, by a regression per channel and window of a forecast.
#pragma once

#include "runtime/src/forecast/learned_forecast.hpp"

#include <lbea/forecast.hpp>

#include <vector>

namespace lbea {

struct ModelView;

/// Composes values of the runs' means and of deviations that windows add. Nothing but the constructor allocates.
class ChannelForecaster {
 public:
  explicit ChannelForecaster(const ModelView& view);

  /// One per channel; none of a model that was baked without.
  [[nodiscard]] std::span<const ChannelForecast> all() const noexcept { return channels_; }
  /// The runs' means: at a time, in nodes, and at the end.
  void begin(float at) noexcept;
  /// No value of the moment is known.
  void forget_time() noexcept;
  /// Adds this share of the bounds of a row of the numbers; see LearnedForecast.
  void add_bounds(std::size_t row, float share) noexcept;
  /// Adds this share of what the components of a window say, with the ridges of a row of the numbers.
  void add(std::size_t window, std::size_t row, std::span<const float> components, float share) noexcept;

 private:
  [[nodiscard]] const double* numbers(std::size_t row, std::size_t channel) const noexcept;
  [[nodiscard]] float deviation(std::size_t window, std::size_t value, double ridge,
                                std::span<const float> components) const noexcept;

  const LearnedForecast& learned_;
  std::vector<ChannelForecast> channels_;
  std::vector<float> means_;  // per channel, of the trained runs: (1 + nodes means_per_node)
};

}  // namespace lbea
