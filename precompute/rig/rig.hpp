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
  [[nodiscard]] bool faces_both(const Vec3& point, const Vec3& normal, double min_cos_incidence) const {
    const Vec3 from_right = point - right_eye;
    const double left = dot(normal, point), right = dot(normal, from_right);
    const double least = min_cos_incidence * min_cos_incidence * dot(normal, normal);
    return left * right > 0 && left * left >= least * dot(point, point) &&
           right * right >= least * dot(from_right, from_right);
  }

 private:
  void add(std::uint32_t element, const std::array<std::uint32_t, 4>& quad);
};

struct Pixel {
  std::uint32_t column, row;
};

/// Pixels of the left camera on surfaces that face both cameras.
struct MeasuredPixels {
  std::span<const Pixel> pixels;       // row by row
  std::span<const Vec3> points;        // what they see
  std::span<const std::uint8_t> seen;  // 1: the right camera sees the point, too
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
  /// The pixels that render() calls measured are those seen from the right. Valid until the next call.
  [[nodiscard]] MeasuredPixels measured(double min_cos_incidence);

 private:
  void keep_live_triangles(const SurfaceState& state);
  /// Finds pixels_ and points_; visit(Pixel, triangle, depth) for all pixels on a surface.
  template <class Visit>
  void see_from_left(double min_cos_incidence, const Visit& visit);

  const Rig& rig_;
  CameraView left_, right_;
  std::vector<Vec3> nodes_, right_nodes_;  // in each camera's coordinates
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> element_;  // of each triangle
  std::vector<Pixel> pixels_;           // whose points face both cameras
  std::vector<Vec3> points_, right_points_;
  std::vector<std::uint8_t> seen_left_, seen_right_;
};

/// From what the cameras see to what the rig delivers: noise, dropouts, outliers, background. See VirtualSensor::sense.
[[nodiscard]] std::vector<Point> measure(const Rig& rig, PlacedMesh& mesh, const SensingNoise& noise,
                                         std::uint64_t seed);
}  // namespace lbea::bake::sensing
