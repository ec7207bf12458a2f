// Pinhole cameras: poses in double, rays through pixels, visibility of points.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

namespace lbea::bake {
struct Vec3 {
  double x = 0, y = 0, z = 0;
};
[[nodiscard]] inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
[[nodiscard]] inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[nodiscard]] inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[nodiscard]] double norm(const Vec3& a);

/// T_to_from in double: the cameras' relative pose is a small difference of large numbers.
struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
  Vec3 translation;

  [[nodiscard]] Vec3 operator()(const Vec3& from) const {
    const auto& r = rotation;
    return {r[0] * from.x + r[1] * from.y + r[2] * from.z + translation.x,
            r[3] * from.x + r[4] * from.y + r[5] * from.z + translation.y,
            r[6] * from.x + r[7] * from.y + r[8] * from.z + translation.z};
  }
  [[nodiscard]] Pose inverse() const;
};
[[nodiscard]] Pose operator*(const Pose& T_c_b, const Pose& T_b_a);
/// Throws Error{bad_config}, naming `what`, when the matrix is not finite or its left part not a rotation.
[[nodiscard]] Pose to_pose(const RigidTransform& transform, const char* what);

/// The image plane, the same in both cameras. Pixel (column, row) has its centre at (column + 1/2, row + 1/2).
class PinholeImage {
 public:
  /// Throws Error{bad_config} for an invalid size or focal length.
  explicit PinholeImage(const StereoSensor& sensor);
  [[nodiscard]] std::uint32_t width() const { return width_; }
  [[nodiscard]] std::uint32_t height() const { return height_; }
  [[nodiscard]] std::size_t pixels() const { return std::size_t{width_} * height_; }
  /// Direction with z = 1 through a pixel's centre.
  [[nodiscard]] Vec3 direction(std::uint32_t column, std::uint32_t row) const {
    return {(column + 0.5 - 0.5 * width_) / focal_, (row + 0.5 - 0.5 * height_) / focal_, 1};
  }
  /// The point of depth z on the ray through a pixel's centre; pixels are counted row by row from the top left.
  [[nodiscard]] Vec3 at_depth(std::size_t pixel, double depth) const {
    const Vec3 d = direction(static_cast<std::uint32_t>(pixel % width_), static_cast<std::uint32_t>(pixel / width_));
    return {depth * d.x, depth * d.y, depth};
  }
  /// Where a point in camera coordinates, z > 0, appears.
  [[nodiscard]] double column_of(const Vec3& point) const { return focal_ * point.x / point.z + 0.5 * width_; }
  [[nodiscard]] double row_of(const Vec3& point) const { return focal_ * point.y / point.z + 0.5 * height_; }
  /// Whether a point in camera coordinates lies in front of the camera and inside its image.
  [[nodiscard]] bool sees(const Vec3& point) const { return sees(point, column_of(point), row_of(point)); }
  /// The same when its column and row are known.
  [[nodiscard]] bool sees(const Vec3& point, double column, double row) const {
    return point.z > 0 && column >= 0 && column < width_ && row >= 0 && row < height_;
  }

 private:
  std::uint32_t width_, height_;
  double focal_;
};
}  // namespace lbea::bake
