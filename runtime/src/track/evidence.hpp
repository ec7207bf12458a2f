// How the tracker, the likeliest path and the inference weigh a frame's candidates.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <lbea/tracker.hpp>

#include <algorithm>

namespace lbea {

/// Likelihood of a candidate by its residual: its plausibility, but at least `doubt`, so that a single wrong frame
/// cannot exclude what all others support.
class Likelihood {
 public:
  Likelihood(float least_residual, const TrackerConfig& config) noexcept
      : plausibility_(least_residual, config.noise, config.sharpness) {}
  [[nodiscard]] double operator()(float residual) const noexcept {
    constexpr double doubt = 1e-9;
    return std::max(plausibility_(residual), doubt);
  }

 private:
  Plausibility<double> plausibility_;
};

struct WeightedRow {
  std::span<const float> values;
  float weight = 0;
};

/// into[i] = sum of weight * values[i]. Rows have the same length, and weights that add up to 1.
void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into);

/// into[i] = sqrt(sum of weight * |values[i] - about[i]|^2 / sum of weight), per group of `components` values: the
/// standard deviation of the rows about a value that need not be their mean.
void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into);

}  // namespace lbea
