// The residuals that an unseen run leaves in the depth images, learned by leaving each simulation out: beyond them, no
// simulation fits.
#pragma once

#include "precompute/depth_images/depth_renderer.hpp"

#include <functional>

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
  std::vector<float> by_step_;
};

/// Ratios of residual to expected residual beyond which no simulation fits.
struct MisfitLimits {
  float frame = 3, test = 3;  // defaults, used when there are too few samples
};

/// Robust limits of the logarithms, median + k deviations: of the frames' misfits, and of their means over each run.
[[nodiscard]] MisfitLimits misfit_limits(std::span<const LeftOut> answers, const ExpectedResiduals& expected,
                                         float mesh_noise = DepthMetric{}.mesh_noise);

struct LearnedResiduals {
  std::vector<float> expected;  // s: the residual that an unseen run leaves at this sample's time step
  MisfitLimits limits;
};

/// Fills `images` with those of the samples from `first` on, padded_cells() each; called from any thread.
using ImageReader = std::function<void(std::size_t first, std::span<std::uint16_t> images)>;

/// samples: ascending. Every sample (of many, every k-th) is compared with all samples of the other simulations; the
/// least residual is what an unseen run leaves. The images are read a few at a time; memory does not grow with their
/// number. metric: length unit of the samples.
[[nodiscard]] LearnedResiduals learn_residuals(const DepthCamera& camera, std::span<const Sample> samples,
                                               const ImageReader& read, const DepthMetric& metric, unsigned threads);

/// Renders the depth images of a finished model's samples, for another pose than the one it was baked for.
/// progress, when given, is called with the number of samples done, from any thread.
[[nodiscard]] SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, unsigned threads,
                                              const std::function<void(std::size_t done)>& progress = {});

}  // namespace lbea::bake
