// What the bake learns about pose errors: runs that are not in the ensemble look like moved ones.
#pragma once

#include "precompute/left_out/left_out_fitter.hpp"
#include "precompute/parallel.hpp"

namespace lbea::bake {

/// As in DepthImages; variance 0: poses are not estimated.
struct LearnedPose {
  double variance = 0;
  PoseErrors by_image{};
  std::optional<PoseErrors> by_points{};  // nothing: most frames have no points
};

/// Left-out runs, whose poses are right, are matched with the other runs over their whole duration.
[[nodiscard]] LearnedPose learn_pose(const SampleSource& source, const FitCosts& costs, const Workers& workers);

}  // namespace lbea::bake
