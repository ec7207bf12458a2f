// Implementation of VirtualSensor: cameras and mesh topology, one state of the mesh before them, and its measurement.
#pragma once

#include "precompute/rig/camera.hpp"
#include "precompute/rig/ray_scene.hpp"
#include "precompute/rig/virtual_sensor.hpp"

namespace lbea::bake::sensing {
using Triangle = std::array<std::uint32_t, 3>;

/// What stays the same from state to state: the cameras and the mesh topology.
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

/// One state of the mesh, in sensor coordinates.
class PlacedMesh {
 public:
  /// Throws Error{bad_input} when the state does not fit the rig's mesh.
  PlacedMesh(const Rig& rig, const SurfaceState& state);

  /// Triangles of elements that are alive.
  [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return live_.triangles; }
  [[nodiscard]] Vec3 node(std::uint32_t index) const;
  [[nodiscard]] Vec3 normal(const Triangle& triangle) const;
  [[nodiscard]] bool hidden_from_left(const Vec3& point) const;
  [[nodiscard]] bool hidden_from_right(const Vec3& point) const;
  [[nodiscard]] SensorImage render(double min_cos_incidence) const;

 private:
  struct Live {
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> element;  // of each triangle
  };
  static Live live_triangles(const Rig& rig, const SurfaceState& state);
  void render_row(std::uint32_t row, double min_cos_incidence, SensorImage& into) const;

  const Rig& rig_;
  std::vector<float> positions_;  // nodes x 3, sensor coordinates
  Live live_;
  RayScene scene_;
};

/// From what the cameras see to what the rig delivers: noise, dropouts, outliers, background. See VirtualSensor::sense.
[[nodiscard]] std::vector<Point> measure(const Rig& rig, const PlacedMesh& mesh, const SensingNoise& noise,
                                         std::uint64_t seed);
}  // namespace lbea::bake::sensing
