#include "runtime/src/match/convex_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

// An upper bound of the largest eigenvalue: the largest absolute row sum.
float eigenvalue_bound(std::span<const float> gram, std::size_t stride, std::size_t k) noexcept {
  float largest = 0;
  for (std::size_t i = 0; i < k; ++i) {
    float row = 0;
    for (std::size_t j = 0; j < k; ++j) row += std::abs(gram[i * stride + j]);
    largest = std::max(largest, row);
  }
  return largest;
}

}  // namespace

std::span<const float> SimplexProblem::solve(std::span<const float> gram, std::size_t stride,
                                             std::span<const float> linear) noexcept {
  constexpr int most_steps = 200;
  constexpr float least_change = 1e-5f;
  const std::size_t k = linear.size();
  const std::span w = std::span(w_).first(k), ahead = std::span(ahead_).first(k), next = std::span(next_).first(k);
  std::ranges::fill(w, 0.0f);
  w[0] = 1;
  std::ranges::copy(w, ahead.begin());
  const float bound = 2 * eigenvalue_bound(gram, stride, k);
  if (!(bound > 0)) return w;
  float momentum = 1;
  for (int step = 0; step < most_steps; ++step) {
    for (std::size_t i = 0; i < k; ++i) next[i] = linear[i];  // the gradient, column by column: whole vectors at once
    for (std::size_t j = 0; j < k; ++j)
      for (std::size_t i = 0; i < k; ++i) next[i] += 2 * ahead[j] * gram[j * stride + i];
    for (std::size_t i = 0; i < k; ++i) next[i] = ahead[i] - next[i] / bound;
    project(next);
    const float faster = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    float change = 0;
    for (std::size_t i = 0; i < k; ++i) {
      change = std::max(change, std::abs(next[i] - w[i]));
      ahead[i] = next[i] + (momentum - 1) / faster * (next[i] - w[i]);
      w[i] = next[i];
    }
    momentum = faster;
    if (change < least_change) break;
  }
  return w;
}

// The nearest point of the simplex: shift all values until the positive ones add up to 1.
void SimplexProblem::project(std::span<float> values) noexcept {
  const std::span sorted = std::span(sorted_).first(values.size());
  std::ranges::copy(values, sorted.begin());
  std::ranges::sort(sorted, std::ranges::greater{});
  float sum = 0, shift = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    sum += sorted[i];
    const float candidate = (sum - 1) / static_cast<float>(i + 1);
    if (sorted[i] > candidate) shift = candidate;
  }
  for (float& value : values) value = std::max(value - shift, 0.0f);
}

}  // namespace lbea
