// Means and standard deviations over weighted rows of values.
#pragma once

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
void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into);

}  // namespace lbea
