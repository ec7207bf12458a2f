// How badly may the best sample fit before one says that no simulation does? Learnt by leaving each simulation out.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace lbea::bake {

/// A sample's image against the best sample of the other simulations.
struct LeftOut {
  Sample sample;
  float mean_square = 0;  // residual squared, length unit squared
};

/// What an unseen run leaves at a time step: the median over the simulations, which a few that nothing explains do not
/// move. Steps with few samples take in their neighbours.
class ExpectedResiduals {
 public:
  explicit ExpectedResiduals(std::span<const LeftOut> answers);
  /// Length unit.
  [[nodiscard]] float at(std::uint32_t time_step) const;

 private:
  std::vector<float> by_step_;
};

/// Residuals over the expected ones beyond which no simulation fits.
struct MisfitLimits {
  float frame = 3, test = 3;  // where there is nothing to learn from
};

/// Robust limits of the logarithms, median + k deviations: of the frames' misfits, and of their means over each run.
[[nodiscard]] MisfitLimits misfit_limits(std::span<const LeftOut> answers, const ExpectedResiduals& expected);

}  // namespace lbea::bake
