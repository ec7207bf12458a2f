// The stereo rig as a pair of pinhole cameras, and the errors of its measurements.
#pragma once

#include <lbea/lbea.hpp>

namespace lbea::bake {
/// Two equal pinhole cameras. Axes x right, y down, z forward; the origin is the left camera's eye, the
/// principal point the image centre. Both poses map to reference coordinates, in the mesh's length unit.
struct StereoSensor {
  RigidTransform T_reference_sensor = identity_transform;  // sensor = left camera
  RigidTransform T_reference_right = identity_transform;
  float focal_px = 1350;
  std::uint32_t width_px = 720, height_px = 300;
};

/// How a measured point differs from the surface, and which points are not measured at all.
struct SensingNoise {
  float sigma = 0.1f;               // length unit, along the ray
  float outliers = 0.001f;          // share of points
  float min_cos_incidence = 0.17f;  // between surface normal and line of sight, in both cameras
  float dropout = 0;                // share of points lost at random
  float background = 0;             // share of extra points from a floor or wall behind the component
};
}  // namespace lbea::bake
