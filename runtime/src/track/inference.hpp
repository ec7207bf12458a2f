// Weighted means of the samples' rows, for the inference of fields.
#pragma once

#include <lbea/inference.hpp>

#include <span>
#include <vector>

namespace lbea {

struct WeightedRow {
  std::span<const float> values;
  float weight = 0;
};

/// into[i] = sum of weight * values[i]. Rows have the same length, and weights that add up to 1. Values that are not
/// numbers do not count; with half of the weights' amounts in them, nor is the result.
void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into);

/// into[i] = sqrt(sum of weight * |values[i] - about[i]|^2 / sum of weight), per group of `components` values: the
/// standard deviation of the rows about a value that need not be their mean. Of single values, those that are not
/// numbers do not count; without others, nor is the result.
void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into);

/// Mean and spread, of a field both numbers or neither; bound_90 becomes empty. A field's (components = 1) mean is
/// limited to the range of the rows.
void infer(std::span<const WeightedRow> estimate, std::span<const WeightedRow> plausible, std::size_t components,
           Inferred& into);

/// Of the values that are finite; 0 without any.
[[nodiscard]] double root_mean_square(std::span<const float> values) noexcept;

/// sqrt(spread[i]^2 + share^2 * mean of spread^2): where the plausible samples agree, they may all be wrong. Values
/// that are not finite stay so, and do not count in the mean.
void even_out(std::span<float> spread, double share) noexcept;

/// As in lbea/inference.hpp. config: with a noise.
[[nodiscard]] std::vector<WeightedSample> plausible_samples(std::span<const Match> candidates,
                                                            const TrackerConfig& config);

}  // namespace lbea
