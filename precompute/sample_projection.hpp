// Second pass over the runs, method steps 3 and 5: every sample brought onto every reference mesh and projected.
#pragma once

#include "precompute/ensemble.hpp"
#include "precompute/envelope.hpp"
#include "precompute/model_writer.hpp"
#include "precompute/reference_basis.hpp"
#include "precompute/sample_views.hpp"
#include "precompute/stage.hpp"
#include "precompute/survey.hpp"

#include <Eigen/Dense>

#include <array>
#include <cstdint>
#include <vector>

namespace lbea {

struct ProjectionTask {
  const Ensemble& ensemble;
  const Survey& survey;
  const std::vector<ReferenceBasis>& references;
  bool with_correspondence = true;
  SampleViews* views = nullptr;  // rendered into, when given
};

struct ProjectedSamples {
  double kept_variance = 0;  // share of the samples' variance the modes keep, over all references; NaN when nothing varies
  std::vector<std::array<std::uint32_t, 3>> leading_axes;  // per reference, see Moments
  std::vector<std::vector<float>> last_states;             // per run: some of its last sample's nodes, x 3
};

/// Writes node positions, fields, coefficients and correspondences of all samples and adds their surfaces to the
/// envelope. A step of the stage is a sample.
[[nodiscard]] ProjectedSamples project_samples(const ProjectionTask& task, ModelWriter& writer,
                                     EnvelopeBuilder& envelope, unsigned threads, Stage& stage);

}  // namespace lbea
