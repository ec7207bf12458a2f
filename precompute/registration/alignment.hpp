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

namespace lbea {

/// A place on a free edge of the surface: where the cloud should end.
struct EdgePlace {
  Eigen::Vector3d position, outward;  // outward: in the surface, across the edge
};

/// Free edges (of one element only) of the kept elements, in steps of at most `step`.
[[nodiscard]] std::vector<EdgePlace> free_edges(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
                                                std::span<const std::uint8_t> kept, double step);

struct AlignmentState {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  // T_reference_sensor
  double cost = 0;       // mean robust squared distance, length unit squared
  double residual = 0;   // root mean square distance of the counted points
  double counted = 0;    // share of the points with a distance below three scales
  Matrix6 normal = Matrix6::Zero();  // mean of J' J over all that counts, in lengths per length
};

class Alignment {
 public:
  /// points: sensor coordinates. spacing: of the whole cloud's points, to know how far before an edge it ends.
  Alignment(const SurfaceTree& surface, std::vector<EdgePlace> edges, std::vector<Eigen::Vector3d> points, double spacing);
  ~Alignment();

  /// Gauss-Newton steps with the weights of Geman and McClure, (k^2 / (k^2 + r^2))^2, for each scale k in turn. `every`:
  /// one of so many points counts.
  [[nodiscard]] AlignmentState align(const Eigen::Isometry3d& start, std::span<const double> scales, std::size_t every) const;

 private:
  struct Equations;
  struct CloudTree;
  [[nodiscard]] Equations equations(const Eigen::Isometry3d& pose, double scale, std::size_t every) const;

  const SurfaceTree& surface_;
  std::vector<EdgePlace> edges_;
  std::vector<Eigen::Vector3d> points_;
  double spacing_;
  Eigen::Vector3d middle_;  // sensor coordinates
  double arm_ = 1;          // root mean square distance from it
  std::unique_ptr<const CloudTree> tree_;
};

}  // namespace lbea
