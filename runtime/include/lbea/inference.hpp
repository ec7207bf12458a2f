// inference.hpp - indirect inference (method step 8): what the samples that explain a frame know and no camera sees.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/tracker.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

/// A field, or the positions, of the shape between the samples, with the spread over the plausible samples: the
/// standard deviation of what they say about `mean`. Kept from frame to frame, its memory is used again.
struct Inferred {
  std::vector<float> mean;    // as Model::field_values(), Model::node_positions()
  std::vector<float> spread;  // one per element or node
};

/// Candidates (SurfaceFit's, with their residuals) weighted as the Tracker weighs them:
/// exp(-sharpness * excess of the squared residual over the least one + noise^2). Weights add up to 1.
[[nodiscard]] LBEA_API std::vector<WeightedSample> plausible_samples(std::span<const Match> candidates,
                                                                     const TrackerConfig& config = {});

/// `estimate`: SurfaceFit's, weights that add up to 1. Both throw Error{bad_input} for samples that the model does not
/// hold; the field must be one of model.fields().
LBEA_API void infer_field(const Model& model, std::uint32_t field, std::span<const WeightedSample> estimate,
                          std::span<const WeightedSample> plausible, Inferred& into);
LBEA_API void infer_positions(const Model& model, std::span<const WeightedSample> estimate,
                              std::span<const WeightedSample> plausible, Inferred& into);

}  // namespace lbea
