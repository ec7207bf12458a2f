// Least squares for the weights of a combination of samples, and their settings.
#pragma once

#include "runtime/src/kernels/kernels.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

/// Minimizes w' G w + c' w over the simplex { w >= 0, sum w = 1 } by an accelerated projected gradient (FISTA).
class SimplexProblem {
 public:
  explicit SimplexProblem(std::size_t most) : w_(most), ahead_(most), next_(most) {}
  /// gram: k x stride, symmetric and positive semi-definite; linear: k values, at most `most`. Returns w, valid until
  /// the next call. Does not allocate.
  std::span<const float> solve(std::span<const float> gram, std::size_t stride, std::span<const float> linear) noexcept;

 private:
  static void project(std::span<float> values, std::span<const float> previous) noexcept;

  std::vector<float> w_, ahead_, next_;
};

/// Adds `scale` times the products of k rows with each other to the upper half of `gram`, k x k. rows: k x stride;
/// sums: space for k floats. Does not allocate.
void add_products(const Kernels& code, const float* rows, std::size_t k, std::size_t stride, float scale,
                  std::span<float> sums, std::span<float> gram) noexcept;

/// Minimizes w' G w + (w - w0)' P (w - w0) subject to sum w = 1, P diagonal: ridge regression about w0, by a Cholesky
/// factorization.
class RidgeProblem {
 public:
  explicit RidgeProblem(std::size_t most) : factor_(most * most), change_(most), ones_(most) {}
  /// gram: k x stride, symmetric and positive semi-definite; prices: P, all positive; w: w0, replaced by the solution.
  /// Does not allocate.
  void solve(std::span<const float> gram, std::size_t stride, std::span<const float> prices,
             std::span<float> w) noexcept;
  /// G + P = U' U.
  void factorize(std::span<const float> gram, std::size_t stride, std::span<const float> prices) noexcept;
  /// Solves (G + P) x = values for the factorized matrix.
  void substitute(std::span<double> values) const noexcept;
  /// ln det(I + G / price) of the factorized k x k matrix, if all prices are this one.
  [[nodiscard]] double log_determinant(std::size_t k, double price) const noexcept;

 private:
  std::vector<double> factor_, change_, ones_;  // factor_: rows of U, from the diagonal on
};

/// Penalties that keep the weights of samples in an estimate small. The bake learns `neighbor` and `correction` from
/// left-out runs; these values are the defaults.
struct EstimatePrices {
  // Of a share, added to the squared residual of the convex combination:
  float residual = 0.2f;   // times the sample's squared residual
  float distance = 0.05f;  // times its squared mean distance from the best candidate: a blend of two deformation
                           // branches is not a possible shape
  // Of leaving the convex combination, so that the estimate can lie beside the candidates, per squared change of a
  // share. Where something hides a part the combination stays convex.
  float change = 0.3f;           // times the candidates' mean squared residual
  float change_distance = 0.5f;  // times the candidate's squared mean distance from the best one
  // Of the squared weights of the samples nearest to the shape between the candidates' combination and the regression's
  // prediction:
  float neighbor = 0.01f;  // times their mean squared distance from that shape
  // Of the squared changes of the weights when the estimate is moved to the frame's points, also where they tell the
  // pose; the smaller it is, the more readily one sample becomes the estimate:
  float correction = 0.01f;  // times its samples' mean squared distance from it

  friend bool operator==(const EstimatePrices&, const EstimatePrices&) = default;
};

/// In the order of files.
inline constexpr std::array all_prices{&EstimatePrices::residual, &EstimatePrices::distance,
                                       &EstimatePrices::change,   &EstimatePrices::change_distance,
                                       &EstimatePrices::neighbor, &EstimatePrices::correction};

struct FitSettings {
  std::uint32_t proposals = 256;        // samples whose depth images are compared
  std::uint32_t candidates = 24;        // the best of them, which the estimate combines
  std::uint32_t joint_candidates = 48;  // the same by the images of several rigs, which tell more shapes apart
  // Something hides a part of the component if no sample explains the whole frame: if the least squared residual is
  // more than this times the least one without the cells far from what the frame shows
  float hidden = 1.6f;
  EstimatePrices prices{};  // of the depth images
  // The estimate is a combination of this many samples nearest to the shape between the candidates' combination and the
  // regression's prediction
  std::uint32_t neighbors = 48;
  // The estimate is moved to the frame's points:
  float correction_shift = 3;   // in mesh noises: shift of the component that costs as much as a change by 1
  float correction_strip = 30;  // the same for a strip that is missing along open edges: nearly free
  // Rank of a candidate: squared mean distance from the estimate, plus this times its squared residual unless the
  // estimate has been moved to the points
  float residual_rank = 0.2f;
  float sharpness = 8;  // of the Plausibility

  /// Most samples in an estimate.
  [[nodiscard]] constexpr std::uint32_t most_combined() const noexcept {
    return std::max({candidates, joint_candidates, neighbors});
  }
};

}  // namespace lbea
