#include "precompute/rig/camera.hpp"

#include <cmath>

namespace lbea::bake {
namespace {
constexpr double rotation_tolerance = 1e-3;  // of each entry of R R' - I: leaves room for rounded calibrations
constexpr std::uint64_t max_pixels = std::uint64_t{1} << 26;

bool is_rotation(const Pose& pose) {
  const auto& r = pose.rotation;
  const Vec3 x{r[0], r[1], r[2]}, y{r[3], r[4], r[5]}, z{r[6], r[7], r[8]};
  const auto near = [](double value, double wanted) { return std::abs(value - wanted) <= rotation_tolerance; };
  return near(dot(x, x), 1) && near(dot(y, y), 1) && near(dot(z, z), 1) && near(dot(x, y), 0) && near(dot(y, z), 0) &&
         near(dot(z, x), 0) && near(dot(cross(x, y), z), 1);
}
}  // namespace

double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }

Pose Pose::inverse() const {
  const auto& r = rotation;
  Pose result{{r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}, {}};
  result.translation = Vec3{} - result(translation);
  return result;
}

Pose operator*(const Pose& T_c_b, const Pose& T_b_a) {
  Pose result;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += T_c_b.rotation[row * 3 + k] * T_b_a.rotation[k * 3 + column];
      result.rotation[row * 3 + column] = sum;
    }
  result.translation = T_c_b(T_b_a.translation);
  return result;
}

Pose to_pose(const RigidTransform& t, const char* what) {
  for (const float value : t)
    if (!std::isfinite(value))
      throw Error{Status::bad_config, std::string(what) + " holds a number that is not finite; check the calibration"};
  const Pose pose{{t[0], t[1], t[2], t[4], t[5], t[6], t[8], t[9], t[10]}, {t[3], t[7], t[11]}};
  if (!is_rotation(pose))
    throw Error{Status::bad_config, std::string(what) +
                                        " does not begin with a rotation (orthonormal rows, determinant 1); check the "
                                        "calibration's order of rows and columns"};
  return pose;
}

PinholeImage::PinholeImage(const StereoSensor& sensor)
    : width_(sensor.width_px), height_(sensor.height_px), focal_(sensor.focal_px) {
  if (!std::isfinite(focal_) || focal_ <= 0)
    throw Error{Status::bad_config, "the sensor's focal length of " + std::to_string(focal_) + " px is not positive"};
  if (width_ == 0 || height_ == 0 || std::uint64_t{width_} * height_ > max_pixels)
    throw Error{Status::bad_config, "the sensor's image of " + std::to_string(width_) + " x " +
                                        std::to_string(height_) + " px is empty or beyond " +
                                        std::to_string(max_pixels) + " pixels"};
}
}  // namespace lbea::bake
