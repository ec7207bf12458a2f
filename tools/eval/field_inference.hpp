// Indirect inference (method step 8): what the estimate's samples know that the cameras cannot see.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/tracker.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

struct WeightedRow {
  std::span<const float> values;
  float weight = 0;
};

/// into[i] = sum of weight * values[i], for rows of the same length whose weights add up to 1.
void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into);

/// into[i] = sqrt(sum of weight * |values[i] - about[i]|^2 / sum of weight), per group of `components` values: the
/// standard deviation of what the rows say, about a value that need not be their mean.
void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components, std::vector<float>& into);

/// Candidates weighted by how plausible their residuals are beside the best one's: exp(-sharpness * excess of the square
/// over the best square + noise^2), as the Tracker weighs them. Weights add up to 1.
[[nodiscard]] std::vector<WeightedSample> plausible_samples(std::span<const Match> candidates, const TrackerConfig& config = {});

/// A field, or the positions, of the shape between the samples, with the spread over the plausible samples.
struct Inferred {
  std::vector<float> mean;    // as Model::field_values(), Model::node_positions()
  std::vector<float> spread;  // one per element or node
};
void infer_field(const Model& model, std::uint32_t field, std::span<const WeightedSample> estimate,
                 std::span<const WeightedSample> plausible, Inferred& into);
void infer_positions(const Model& model, std::span<const WeightedSample> estimate, std::span<const WeightedSample> plausible,
                     Inferred& into);

}  // namespace lbea
