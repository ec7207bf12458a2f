// The residuals that an unseen run leaves in the depth images: beyond them, no simulation fits.
#pragma once

#include "runtime/src/depth/image_comparison.hpp"

#include <vector>

namespace lbea::bake {

/// A sample's image compared with the best sample of the other simulations.
struct LeftOut {
  Sample sample;
  float mean_square = 0;  // residual squared, length unit squared
};

/// The residual that an unseen run leaves at a time step: the median over the simulations, robust against a few that no
/// other one explains. Steps with few samples include their neighbors.
class ExpectedResiduals {
 public:
  explicit ExpectedResiduals(std::span<const LeftOut> answers);
  /// Length unit.
  [[nodiscard]] float at(std::uint32_t time_step) const;

 private:
  std::vector<LeftOut> answers_;  // by time step
};

/// Ratios of residual to expected residual beyond which no simulation fits.
struct MisfitLimits {
  float frame = 3, test = 3;  // defaults, used when there are too few samples
};

/// Robust limits of the logarithms, median + k deviations: of the frames' misfits, and of their means over each run.
[[nodiscard]] MisfitLimits misfit_limits(std::span<const LeftOut> answers, const ExpectedResiduals& expected,
                                         float mesh_noise = DepthMetric{}.mesh_noise);

}  // namespace lbea::bake
