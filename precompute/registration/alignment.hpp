// One alignment of a cloud with a surface from one start: the work horse of the registration.
#pragma once

#include "precompute/registration/rigid_motion.hpp"
#include "precompute/registration/surface_tree.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea::bake {

/// The surface of one shape, and its free edges.
class AlignmentTarget {
 public:
  /// A place on a free edge, of one element only: the cloud ends there.
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
  /// chosen: of all points, evenly; they are laid on the surface. `all` tell where the cloud ends.
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

/// Gauss-Newton steps of the pose until it stands still.
[[nodiscard]] Eigen::Isometry3d align(const AlignmentTarget& target, const AlignmentCloud& cloud,
                                      const Eigen::Isometry3d& start, const AlignmentSettings& settings);

/// The motion that solves the equations' first six; motions that nothing tells are zero.
[[nodiscard]] Eigen::VectorXd solve_damped(const AlignmentEquations& equations, const Eigen::VectorXd& prior);

}  // namespace lbea::bake
