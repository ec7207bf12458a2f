// Weighted means of the samples' rows, for the inference of fields.
#pragma once

#include <span>
#include <vector>

namespace lbea {

struct WeightedRow {
  std::span<const float> values;
  float weight = 0;
};

/// into[i] = sum of weight * values[i]. Rows have the same length, and weights that add up to 1.
void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into);

/// into[i] = sqrt(sum of weight * |values[i] - about[i]|^2 / sum of weight), per group of `components` values: the
/// standard deviation of the rows about a value that need not be their mean.
void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into);

}  // namespace lbea
