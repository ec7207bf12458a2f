// What a frame's depth image says about its pose: the shape between the candidates and the rigid motion are estimated
// together, from the depths and from the silhouette.
#pragma once

#include "runtime/src/pose/pose_derivatives.hpp"

namespace lbea {

/// Minimizes the mean square of sum_i w_i R_i - J motion over the weights w and the motion, with a prior of the motion:
/// the motion is eliminated (variable projection, Golub and Pereyra 1973).
class PoseFit {
 public:
  /// Allocates all memory, for up to `most` candidates.
  PoseFit(const DepthCamera& camera, const PoseCenter& center, const DepthMetric& metric, std::size_t most);
  /// The motion that the frame lacks, given the prior and the frame. Does not allocate.
  const PoseBelief& estimate(const PoseProblem& problem, const PoseBelief& prior, const FitSettings& settings) noexcept;
  /// The variance of the motions as that of one frame shows it: its square in the metric of the information, per motion
  /// and squared residual. DepthImages::pose_variance is the mean over frames of other runs whose poses are right.
  [[nodiscard]] double variance() const noexcept { return variance_; }

 private:
  void add_up(const PoseProblem& problem) noexcept;
  void add_edges(const PoseProblem& problem, std::size_t candidate) noexcept;
  [[nodiscard]] float least_square() const noexcept;
  void eliminate(const PoseBelief& prior, double weight) noexcept;
  void combine(const PoseProblem& problem, const FitSettings& settings) noexcept;
  void find_motion(const PoseBelief& prior) noexcept;
  [[nodiscard]] PoseMatrix absorbed() noexcept;
  void find_information() noexcept;
  [[nodiscard]] std::span<float> products(std::size_t i) noexcept { return std::span(products_).subspan(6 * i, 6); }
  [[nodiscard]] std::span<float> reduced(std::size_t i) noexcept { return std::span(reduced_).subspan(6 * i, 6); }

  const Kernels& code_;
  float squared_step_, one_sided_;
  double noise_;  // length unit
  PoseDerivatives derivatives_;
  std::size_t edge_stride_ = 0, k_ = 0;           // of a frame
  std::vector<float> shares_, replaced_;          // k x edge cells: differences of shares, and the costs they replace
  std::vector<float> gram_, products_, reduced_;  // R_i'R_j; J'R_i; the latter after eliminate(), k x 6
  PoseMatrix normal_{}, full_{};                  // J'J; with the prior
  SimplexProblem simplex_;
  RidgeProblem ridge_;
  std::vector<float> prices_, weights_;
  std::vector<double> solved_;  // 7 x k
  PoseBelief posterior_;
  double variance_ = 0;
};

}  // namespace lbea
