// What method fit learns from the ensemble: samples of each run are matched with the other runs.
#pragma once

#include "precompute/channels/channel_bounds.hpp"
#include "precompute/depth_images/learned_pose.hpp"
#include "precompute/depth_images/residuals.hpp"
#include "precompute/depth_images/shape_training.hpp"
#include "precompute/parallel.hpp"

namespace lbea::bake {

/// What the estimate of a left-out frame looks like.
struct EstimatedShape {
  std::size_t sample = 0;
  std::array<float, ShapeRegression::shape_scores> scores{};
};

struct LearnedFit {
  FitCosts costs;               // metric: length unit; of five, see choose_metric()
  std::vector<float> expected;  // s: the residual that an unseen run leaves at this sample's time step
  MisfitLimits limits{};
  ErrorBound error_bound{};         // of frames with a full view
  ErrorBound hidden_error_bound{};  // of frames with a hidden third
  LearnedPose pose{};
  float time_variation = 0;           // of DepthImages
  std::vector<SpreadBound> bounds{};  // the same; empty if the source has no read_field
  TrainedShapes shapes;
  // Of left-out runs, at the times of the forecast; empty: no times or no shapes.
  std::vector<EstimatedShape> tests{}, hidden_tests{};  // seen completely; with a third hidden
  // Per channel: of frames seen completely, and with a third hidden
  std::vector<std::array<ChannelBound, LearnedChannels::kinds>> channels{};
};

/// Frames with a full view and with a connected third hidden, of samples spread over the ensemble, are matched by
/// SurfaceFitter against all other simulations. Ensembles of one simulation keep the defaults. The same input gives the
/// same result on any number of threads.
[[nodiscard]] LearnedFit learn_fit(const SampleSource& source, const Workers& workers);

}  // namespace lbea::bake
