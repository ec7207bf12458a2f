// Implementation of VirtualSensor: cameras and mesh topology, one state of the mesh before them, and its measurement.
#pragma once

#include "precompute/rig/camera_view.hpp"
#include "precompute/rig/virtual_sensor.hpp"

namespace lbea::bake::sensing {

/// What stays the same from state to state: the cameras and the mesh topology.
struct Rig {
  StereoSensor sensor;
  PinholeImage plane;
  Pose T_sensor_reference, T_right_sensor;
  Vec3 right_eye;  // in sensor coordinates
  std::size_t nodes, elements;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> triangle_element;

  Rig(const StereoSensor& description, std::size_t node_count, std::span<const std::array<std::uint32_t, 4>> quads);

  /// Whether both cameras look at the same side of a surface with this normal, and neither along it.
  [[nodiscard]] bool faces_both(const Vec3& point, const Vec3& normal, double min_cos_incidence) const;

 private:
  void add(std::uint32_t element, const std::array<std::uint32_t, 4>& quad);
};

/// One state of the mesh before both cameras, in sensor coordinates. Keeps its memory from state to state; for one
/// thread.
class PlacedMesh {
 public:
  explicit PlacedMesh(const Rig& rig) : rig_(rig), left_(rig.plane), right_(rig.plane) {}
  PlacedMesh(const Rig& rig, const SurfaceState& state) : PlacedMesh(rig) { place(state); }
  /// Throws Error{bad_input} when the state does not fit the rig's mesh.
  void place(const SurfaceState& state);

  /// Triangles of elements that are alive and whose positions are finite.
  [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return triangles_; }
  [[nodiscard]] std::span<const Vec3> nodes() const noexcept { return nodes_; }
  [[nodiscard]] Vec3 normal(const Triangle& triangle) const;
  /// One per point: 1 when it lies in the camera's image and nothing hides it. Valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> seen_from_left(std::span<const Vec3> points);
  [[nodiscard]] std::span<const std::uint8_t> seen_from_right(std::span<const Vec3> points);
  void render(double min_cos_incidence, SensorImage& image);

 private:
  void keep_live_triangles(const SurfaceState& state);
  void see_from_left(double min_cos_incidence, SensorImage& image);

  const Rig& rig_;
  CameraView left_, right_;
  std::vector<Vec3> nodes_, right_nodes_;  // in each camera's coordinates
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> element_;  // of each triangle
  std::vector<std::size_t> pixels_;     // whose points face both cameras
  std::vector<Vec3> points_, right_points_;
  std::vector<std::uint8_t> seen_left_, seen_right_;
};

/// From what the cameras see to what the rig delivers: noise, dropouts, outliers, background. See VirtualSensor::sense.
[[nodiscard]] std::vector<Point> measure(const Rig& rig, PlacedMesh& mesh, const SensingNoise& noise,
                                         std::uint64_t seed);
}  // namespace lbea::bake::sensing
