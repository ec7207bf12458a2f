// The inside of VirtualSensor that stays the same from state to state: the cameras and the mesh topology.
#pragma once

#include "precompute/rig/camera.hpp"
#include "precompute/rig/ray_scene.hpp"
#include "precompute/rig/virtual_sensor.hpp"

namespace lbea::bake::sensing {

using Triangle = std::array<std::uint32_t, 3>;

struct Rig {
  StereoSensor sensor;
  PinholeImage plane;
  Pose T_sensor_reference, T_right_sensor;
  Vec3 right_eye;  // in sensor coordinates
  std::size_t nodes, elements;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> triangle_element;
  unsigned threads;
  RayDevice device;

  Rig(const StereoSensor& description, std::size_t node_count, std::span<const std::array<std::uint32_t, 4>> quads,
      unsigned wanted_threads);

  [[nodiscard]] bool in_left_image(const Vec3& point) const { return plane.sees(point); }
  [[nodiscard]] bool in_right_image(const Vec3& point) const { return plane.sees(T_right_sensor(point)); }
  /// Whether both cameras look at the same side of a surface with this normal, and neither along it.
  [[nodiscard]] bool faces_both(const Vec3& point, const Vec3& normal, double min_cos_incidence) const;

 private:
  void add(std::uint32_t element, const std::array<std::uint32_t, 4>& quad);
};

}  // namespace lbea::bake::sensing
