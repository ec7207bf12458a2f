// Aligns a cloud with a surface from one start pose. Rigid motions are in double.
#pragma once

#include "precompute/registration/surface_tree.hpp"

#include <lbea/lbea.hpp>

#include <Eigen/Geometry>

namespace lbea::bake {
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

[[nodiscard]] inline Eigen::Isometry3d to_isometry(const RigidTransform& T) {
  Eigen::Matrix3d rotation;
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) rotation(i, j) = double{T[static_cast<std::size_t>(4 * i + j)]};
    result.translation()(i) = double{T[static_cast<std::size_t>(4 * i + 3)]};
  }
  result.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();  // poses are written with few digits
  return result;
}

[[nodiscard]] inline RigidTransform to_transform(const Eigen::Isometry3d& T) {
  RigidTransform result{};
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 4; ++j) result[static_cast<std::size_t>(4 * i + j)] = static_cast<float>(T(i, j));
  return result;
}

/// motion: turn (axis times angle times `arm`) and shift, both lengths, so that their sizes can be compared.
[[nodiscard]] inline Eigen::Isometry3d motion_about(const Eigen::Vector3d& centre, double arm, const Vector6& motion) {
  const Eigen::Vector3d turn = motion.head<3>() / arm, shift = motion.tail<3>();
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const double angle = turn.norm();
  if (angle > 0) result.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  result.translation() = centre - result.linear() * centre + shift;
  return result;
}

/// The surface of one shape, and its free edges.
class AlignmentTarget {
 public:
  /// A place on a free edge (an edge of only one element): the cloud ends there.
  struct EdgePlace {
    Eigen::Vector3d position, outward;  // outward: in the surface, across the edge
    std::array<std::uint32_t, 2> nodes;
    std::array<double, 2> shares;
  };
  /// kept: one per element; empty: all. Edge places are at most `step` apart.
  AlignmentTarget(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
                  std::span<const std::uint8_t> kept, double step);

  [[nodiscard]] const SurfaceTree& surface() const noexcept { return surface_; }
  [[nodiscard]] const std::vector<EdgePlace>& edges() const noexcept { return edges_; }

 private:
  SurfaceTree surface_;
  std::vector<EdgePlace> edges_;
};

/// The cloud, sensor coordinates.
class AlignmentCloud {
 public:
  /// chosen: number of points that are aligned with the surface, evenly chosen; `all` show where the cloud ends.
  AlignmentCloud(std::vector<Eigen::Vector3d> all, std::size_t chosen);
  ~AlignmentCloud();
  [[nodiscard]] const std::vector<Eigen::Vector3d>& chosen() const noexcept { return chosen_; }
  [[nodiscard]] std::size_t size() const noexcept { return all_.size(); }
  [[nodiscard]] const Eigen::Vector3d& middle() const noexcept { return middle_; }  // of the chosen
  [[nodiscard]] double arm() const noexcept { return arm_; }                        // root mean square distance from it
  [[nodiscard]] const Eigen::Vector3d& nearest(const Eigen::Vector3d& to) const;    // of all

 private:
  struct Tree;
  std::vector<Eigen::Vector3d> all_, chosen_;
  Eigen::Vector3d middle_;
  double arm_ = 1;
  std::unique_ptr<const Tree> tree_;
};

/// Normal equations J'WJ x = J'W(-r) of pose (turn times arm, shift) and shape.
struct AlignmentEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  double weights = 0;
  double cost = 0;                        // mean robust squared distance, length unit squared
  double squares = 0;                     // of the counted distances
  std::size_t asked = 0, counted = 0;     // points; those within three scales
  [[nodiscard]] double residual() const;  // root mean square of the counted
};

struct AlignmentSettings {
  double scale = 1;       // k in the weights of Geman and McClure, (k^2 / (k^2 + r^2))^2; length unit
  double spacing = 0;     // between neighbouring points on the surface: the cloud ends half of it before an edge
  std::size_t every = 1;  // one of so many chosen points counts
};

/// modes: each nodes x 3; without any, the pose alone.
[[nodiscard]] AlignmentEquations alignment_equations(const AlignmentTarget& target, const AlignmentCloud& cloud,
                                                     const Eigen::Isometry3d& pose,
                                                     std::span<const std::vector<float>> modes,
                                                     const AlignmentSettings& settings);

/// Gauss-Newton steps of the pose until it converges.
[[nodiscard]] Eigen::Isometry3d align(const AlignmentTarget& target, const AlignmentCloud& cloud,
                                      const Eigen::Isometry3d& start, const AlignmentSettings& settings);

/// The motion that solves the equations' first six; unobservable motions are zero.
[[nodiscard]] Eigen::VectorXd solve_damped(const AlignmentEquations& equations, const Eigen::VectorXd& prior);
}  // namespace lbea::bake
