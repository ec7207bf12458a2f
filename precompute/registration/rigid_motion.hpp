// Small rigid motions about a centre, in double.
#pragma once

#include <lbea/lbea.hpp>

#include <Eigen/Geometry>

#include <cstddef>

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

}  // namespace lbea::bake
