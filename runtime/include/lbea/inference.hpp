// inference.hpp - indirect inference (method step 8): fields and positions that no camera sees, from the samples that
// explain the frame.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/tracker.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

/// A field, or the node positions, of the estimate, and their spread over the plausible samples. Samples in which an
/// element is eroded, where the field is not a number, do not count; with half of the estimate's weight in them, or
/// without a plausible sample that has the element, mean, spread and bound are NaN there. An object that is kept from
/// frame to frame reuses its memory.
struct Inferred {
  std::vector<float> mean;      // as Model::field_values(), Model::node_positions()
  std::vector<float> spread;    // per element or node: standard deviation of the plausible samples about `mean`
  std::vector<float> bound_90;  // per element or node; empty: the model or the call does not give it
};

/// The candidates of a SurfaceFit, with the Tracker's weights by their residuals r:
/// exp(-sharpness * (r^2 - least r^2) / (least r^2 + noise^2)). Weights add up to 1.
[[nodiscard]] LBEA_API std::vector<WeightedSample> plausible_samples(const Model& model,
                                                                     std::span<const Match> candidates,
                                                                     const TrackerConfig& config = {});

/// With bounds: 90 % of the true values, over all elements or nodes of the frames of runs that are not in the ensemble,
/// differ from `mean` by at most bound_90; positions by at most this distance. The bake learns it from left-out runs,
/// as the sensor sees them for which the model was baked. `field`: below model.fields(). Throw Error{bad_input} for
/// samples that are not in the model.
LBEA_API void infer_field(const Model& model, std::uint32_t field, const SurfaceFit& fit, Inferred& into);
LBEA_API void infer_positions(const Model& model, const SurfaceFit& fit, Inferred& into);

/// Without bounds. `estimate`: of the SurfaceFit, with weights that add up to 1. `field`: below model.fields(); its
/// values stay within those of the estimate's samples. Both functions throw Error{bad_input} for samples that are not
/// in the model.
LBEA_API void infer_field(const Model& model, std::uint32_t field, std::span<const WeightedSample> estimate,
                          std::span<const WeightedSample> plausible, Inferred& into);
LBEA_API void infer_positions(const Model& model, std::span<const WeightedSample> estimate,
                              std::span<const WeightedSample> plausible, Inferred& into);

}  // namespace lbea
