// Small rigid motions, and the normal distribution of one.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <cmath>
#include <numeric>

namespace lbea {

/// A small rigid motion as six lengths: the turn about the component's middle times its arm, then the shift; reference
/// coordinates.
using PoseMotion = std::array<double, 6>;
[[nodiscard]] inline double length_of(const PoseMotion& motion) noexcept {
  return std::sqrt(std::inner_product(motion.begin(), motion.end(), motion.begin(), 0.0));
}
/// Symmetric, row by row.
using PoseMatrix = std::array<double, 36>;
inline constexpr PoseMatrix unit_pose_matrix = [] {
  PoseMatrix matrix{};
  for (std::size_t i = 0; i < 6; ++i) matrix[7 * i] = 1;
  return matrix;
}();

/// Of the component: its middle, and the root mean square distance of its nodes from it.
struct PoseCenter {
  std::array<double, 3> middle{};
  double arm = 1;
  /// Of the first sample's nodes.
  [[nodiscard]] static PoseCenter of(const ModelView& model);
};

[[nodiscard]] RigidTransform transform_of(const PoseMotion& motion, const PoseCenter& center) noexcept;
/// a b.
[[nodiscard]] RigidTransform product(const RigidTransform& a, const RigidTransform& b) noexcept;

/// L L' = matrix, which is positive semi-definite.
class PoseFactor {
 public:
  explicit PoseFactor(const PoseMatrix& matrix) noexcept;
  /// L^-1 b.
  [[nodiscard]] PoseMotion forward(PoseMotion b) const noexcept;
  /// L'^-1 b.
  [[nodiscard]] PoseMotion backward(PoseMotion b) const noexcept;
  [[nodiscard]] PoseMotion solve(const PoseMotion& b) const noexcept { return backward(forward(b)); }
  /// Of the matrix.
  [[nodiscard]] PoseMatrix inverse() const noexcept;
  [[nodiscard]] double operator()(std::size_t row, std::size_t column) const noexcept {
    return lower_[6 * row + column];
  }

 private:
  PoseMatrix lower_{};
};

/// How far runs that are not in the ensemble seem to be moved, in units of what one of their frames says: second
/// moments of L^-1 motion, L L' the frame's covariance, at equal intervals from the impact to the end of a simulation.
struct PoseSpreads {
  static constexpr std::size_t times = 9;
  std::array<PoseMatrix, times> at_times;

  /// Not known: frames are as certain as they say.
  constexpr PoseSpreads() noexcept { at_times.fill(unit_pose_matrix); }
  /// Linear between them. time: in durations of a simulation.
  [[nodiscard]] PoseMatrix at(double time) const noexcept;
};

/// What the bake learned about measured poses. drift_evidence: see DriftTest, of frames that were measured in this way;
/// 0: drifts are not estimated.
struct PoseErrors {
  PoseSpreads spreads{};
  double drift_evidence = 0;
};

/// A normal distribution of the motion.
struct PoseBelief {
  PoseMotion mean{};
  PoseMatrix information{};  // inverse covariance

  /// About no motion. variances: per component.
  [[nodiscard]] static PoseBelief with(const PoseMotion& variances) noexcept {
    PoseBelief belief;
    for (std::size_t i = 0; i < 6; ++i) belief.information[7 * i] = 1 / variances[i];
    return belief;
  }
};

}  // namespace lbea
