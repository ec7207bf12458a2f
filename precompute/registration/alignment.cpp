#include "precompute/registration/alignment.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {

constexpr int most_steps = 30;
constexpr double still = 1e-5;    // of the scale: a step below it is none
constexpr double damping = 1e-6;  // of the mean: motions that nothing tells stay where they are
constexpr double counted_scales = 3, reach_scales = 20, edge_reach_scales = 5;

/// Rows of the Jacobian, weighted and added up.
class Sum {
 public:
  Sum(AlignmentEquations& equations, std::span<const std::vector<float>> modes, double arm)
      : equations_(equations), modes_(modes), arm_(arm) {
    const auto size = static_cast<Eigen::Index>(6 + modes.size());
    equations.normal = Eigen::MatrixXd::Zero(size, size);
    equations.right = Eigen::VectorXd::Zero(size);
    row_.resize(size);
  }

  /// residual = direction . (point - foot); the foot moves with the shape as its nodes' shares say.
  template <std::size_t n>
  void add(const Eigen::Vector3d& from_centre, const Eigen::Vector3d& direction,
           const std::array<std::uint32_t, n>& nodes, const std::array<double, n>& shares, double residual,
           double scale) {
    row_.head<3>() = from_centre.cross(direction) / arm_;
    row_.segment<3>(3) = direction;
    for (std::size_t m = 0; m < modes_.size(); ++m) {
      double along = 0;
      for (std::size_t k = 0; k < n; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          along += shares[k] * double{modes_[m][3 * std::size_t{nodes[k]} + axis]} *
                   direction(static_cast<Eigen::Index>(axis));
      row_(static_cast<Eigen::Index>(6 + m)) = -along;
    }
    const double share = scale * scale / (scale * scale + residual * residual), weight = share * share;
    equations_.normal.noalias() += weight * row_ * row_.transpose();
    equations_.right -= weight * residual * row_;
    equations_.weights += weight;
  }

 private:
  AlignmentEquations& equations_;
  std::span<const std::vector<float>> modes_;
  double arm_;
  Eigen::VectorXd row_;
};

}  // namespace

double AlignmentEquations::residual() const {
  return counted > 0 ? std::sqrt(squares / static_cast<double>(counted)) : 0;
}

// Points: r = distance from the surface; its gradient is the unit vector from the foot: the normal inside the surface,
// across the edge beyond it. Edges: r = how far the cloud goes beyond the edge, half a spacing short of it on average.
AlignmentEquations alignment_equations(const AlignmentTarget& target, const AlignmentCloud& cloud,
                                       const Eigen::Isometry3d& pose, std::span<const std::vector<float>> modes,
                                       const AlignmentSettings& settings) {
  AlignmentEquations equations;
  Sum sum(equations, modes, cloud.arm());
  const double scale = settings.scale;
  const Eigen::Vector3d centre = pose * cloud.middle();
  for (std::size_t i = 0; i < cloud.chosen().size(); i += settings.every) {
    ++equations.asked;
    const Eigen::Vector3d p = pose * cloud.chosen()[i];
    const SurfacePlace place = target.surface().nearest({p.x(), p.y(), p.z()}, reach_scales * scale);
    const double r2 = place.distance * place.distance;
    equations.cost += place.found() ? scale * scale * r2 / (scale * scale + r2) : scale * scale;
    if (place.found() && place.distance > 0)
      sum.add(p - centre, (p - Eigen::Vector3d(place.position.data())) / place.distance, place.nodes, place.shares,
              place.distance, scale);
    if (place.distance > counted_scales * scale) continue;
    ++equations.counted;
    equations.squares += r2;
  }
  equations.cost /= static_cast<double>(std::max<std::size_t>(equations.asked, 1));
  const double edge_scale = std::max(scale, 2 * settings.spacing);
  const Eigen::Isometry3d back = pose.inverse();
  for (const auto& edge : target.edges()) {
    const Eigen::Vector3d p = pose * cloud.nearest(back * edge.position);
    if ((p - edge.position).norm() > edge_reach_scales * edge_scale) continue;
    sum.add(p - centre, edge.outward, edge.nodes, edge.shares,
            (p - edge.position).dot(edge.outward) + 0.5 * settings.spacing, edge_scale);
  }
  return equations;
}

Eigen::VectorXd solve_damped(const AlignmentEquations& equations, const Eigen::VectorXd& prior) {
  Eigen::MatrixXd normal = equations.normal;
  normal.diagonal() += prior;
  normal.diagonal().array() += damping * std::max(normal.trace() / static_cast<double>(normal.rows()), 1e-12);
  return normal.ldlt().solve(equations.right);
}

Eigen::Isometry3d align(const AlignmentTarget& target, const AlignmentCloud& cloud, const Eigen::Isometry3d& start,
                        const AlignmentSettings& settings) {
  Eigen::Isometry3d pose = start;
  for (int step = 0; step < most_steps; ++step) {
    const Vector6 motion = solve_damped(alignment_equations(target, cloud, pose, {}, settings), Vector6::Zero());
    if (!motion.allFinite()) break;
    pose = motion_about(pose * cloud.middle(), cloud.arm(), motion) * pose;
    if (motion.norm() < still * settings.scale) break;
  }
  return pose;
}

}  // namespace lbea::bake
