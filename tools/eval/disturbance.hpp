// What a rig suffers from in practice, done to sensed frames.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct Disturbance {
  std::string name = "as sensed";
  std::optional<float> noise{};     // length unit, instead of the sensor's
  std::optional<float> outliers{};  // share, instead of the sensor's
  double hidden = 0;                // share of the surface that patches hide
  double kept = 1;                  // share of the points, at random
  double pose_error_deg = 0;        // left over after registration
};

[[nodiscard]] bake::SensingNoise disturbed(bake::SensingNoise noise, const Disturbance& disturbance);

/// Round patches about random points of the cloud go until `share` of its points is gone; a patch has `radius`, in the
/// cloud's unit, the last one less. Points that remain keep their order.
[[nodiscard]] std::vector<Point> hide_patches(std::vector<Point> points, double share, double radius,
                                              std::uint64_t seed);

/// Every point stays with probability `share`.
[[nodiscard]] std::vector<Point> thin(std::vector<Point> points, double share, std::uint64_t seed);

/// The pose turned about an axis of random direction through `centre` (reference coordinates).
[[nodiscard]] RigidTransform turned(const RigidTransform& T_reference_sensor, double degrees, const Point& centre,
                                    std::uint64_t seed);

/// Hides and thins; patches have 7 % of the diagonal of the cloud's box as radius.
[[nodiscard]] std::vector<Point> disturbed(std::vector<Point> points, const Disturbance& disturbance,
                                           std::uint64_t seed);

}  // namespace lbea::tool
