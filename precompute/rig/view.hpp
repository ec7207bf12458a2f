// One state of the mesh placed before the cameras.
#pragma once

#include "precompute/rig/rig.hpp"

namespace lbea::bake::sensing {

class View {
 public:
  /// Throws Error{bad_input} when the state does not fit the rig's mesh.
  View(const Rig& rig, const SurfaceState& state);

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

}  // namespace lbea::bake::sensing
