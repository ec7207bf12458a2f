#include "runtime/src/depth/combination.hpp"

#include "runtime/src/numbers/elementary.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

// Upper bound of the largest eigenvalue: the largest absolute row sum.
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
    for (std::size_t i = 0; i < k; ++i) next[i] = linear[i];  // the gradient, column by column, so that it vectorizes
    for (std::size_t j = 0; j < k; ++j) {
      const float twice = 2 * ahead[j];
      if (twice == 0) continue;  // most of them
      for (std::size_t i = 0; i < k; ++i) next[i] += twice * gram[j * stride + i];
    }
    for (std::size_t i = 0; i < k; ++i) next[i] = ahead[i] - next[i] / bound;
    project(next, w);
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

// The nearest point of the simplex: subtracts the shift after which the positive values add up to 1. The shift of any
// values (after which they add up to 1) is not above it. So values that are not above the shift of the previous point's
// positive ones are 0, and those not above the shift of the others, and so on (Michelot 1986). All values may be far
// from 0: relative to the greatest one, the 1 is not lost by rounding, and that value remains positive.
void SimplexProblem::project(std::span<float> values, std::span<const float> previous) noexcept {
  const float greatest = *std::ranges::max_element(values);
  float shift = 0, sum = 0;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += previous[i] > 0 ? values[i] - greatest : 0.0f;
    count += previous[i] > 0 ? 1u : 0u;
  }
  for (bool is_first = true;; is_first = false) {
    shift = (sum - 1) / static_cast<float>(count);
    const std::uint32_t before = count;
    std::uint32_t changed = 0;
    sum = 0;
    count = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {  // without branches, which would be hard to predict
      const float value = values[i] - greatest;
      sum += value > shift ? value : 0.0f;
      count += value > shift ? 1u : 0u;
      changed += (value > shift) != (previous[i] > 0) ? 1u : 0u;
    }
    if (count == 0 || (is_first ? changed == 0 : count >= before)) break;  // none: not finite; the same ones: found
  }
  for (float& value : values) value = std::max(value - greatest - shift, 0.0f);
}

void add_products(const Kernels& code, const float* rows, std::size_t k, std::size_t stride, float scale,
                  std::span<float> sums, std::span<float> gram) noexcept {
  for (std::size_t i = 0; i < k; ++i) {
    code.project(rows, i + 1, stride, rows + i * stride, sums.data());
    for (std::size_t j = 0; j <= i; ++j) gram[j * k + i] += scale * sums[j];
  }
}

// With w = w0 + d: (G + P) d = -G w0 - mu 1, and mu such that sum d = 0.
void RidgeProblem::solve(std::span<const float> gram, std::size_t stride, std::span<const float> prices,
                         std::span<float> w) noexcept {
  const std::size_t k = w.size();
  const std::span change = std::span(change_).first(k), ones = std::span(ones_).first(k);
  factorize(gram, stride, prices);
  for (std::size_t i = 0; i < k; ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < k; ++j) sum -= double{gram[i * stride + j]} * double{w[j]};
    change[i] = sum;
    ones[i] = 1;
  }
  substitute(change);
  substitute(ones);
  double all = 0, unit = 0;
  for (std::size_t i = 0; i < k; ++i) all += change[i], unit += ones[i];
  for (std::size_t i = 0; i < k; ++i) w[i] += static_cast<float>(change[i] - all / unit * ones[i]);
}

// Row by row: the values of a row do not depend on each other, so the compiler can compute several at once.
void RidgeProblem::factorize(std::span<const float> gram, std::size_t stride, std::span<const float> prices) noexcept {
  const std::size_t k = prices.size();
  for (std::size_t j = 0; j < k; ++j) {
    double* const row = &factor_[j * k];
    for (std::size_t i = j; i < k; ++i) row[i] = double{gram[j * stride + i]};
    row[j] += double{prices[j]};
    for (std::size_t m = 0; m < j; ++m) {
      const double* const above = &factor_[m * k];
      const double factor = above[j];
      for (std::size_t i = j; i < k; ++i) row[i] -= factor * above[i];
    }
    row[j] = std::sqrt(std::max(row[j], double{prices[j]}));
    for (std::size_t i = j + 1; i < k; ++i) row[i] /= row[j];
  }
}

void RidgeProblem::substitute(std::span<double> values) const noexcept {
  const std::size_t k = values.size();
  for (std::size_t j = 0; j < k; ++j) {
    values[j] /= factor_[j * k + j];
    for (std::size_t i = j + 1; i < k; ++i) values[i] -= factor_[j * k + i] * values[j];
  }
  for (std::size_t i = k; i-- > 0;) {
    for (std::size_t j = i + 1; j < k; ++j) values[i] -= factor_[i * k + j] * values[j];
    values[i] /= factor_[i * k + i];
  }
}

double RidgeProblem::log_determinant(std::size_t k, double price) const noexcept {
  double sum = 0;
  for (std::size_t j = 0; j < k; ++j) sum += logarithm(factor_[j * k + j] * factor_[j * k + j] / price);
  return sum;
}

}  // namespace lbea
