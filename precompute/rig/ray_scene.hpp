// One state's triangles, ready for ray casting.
#pragma once

#include "precompute/rig/camera.hpp"

#include <optional>

namespace lbea::bake {
/// What builds scenes; shared by all scenes of one sensor. Safe to use from several threads.
class RayDevice {
 public:
  RayDevice();
  ~RayDevice();

 private:
  friend class RayScene;
  struct Handle;
  std::unique_ptr<Handle> handle_;
};

struct RayHit {
  double distance;  // in lengths of the direction
  std::uint32_t triangle;
  Vec3 normal;  // not normalized; its sign follows the triangle's node order
};

/// Immutable, so any number of threads may ask at once.
class RayScene {
 public:
  /// positions: vertices x 3; triangles with a position that is not finite are left out.
  RayScene(const RayDevice& device, std::span<const float> positions,
           std::span<const std::array<std::uint32_t, 3>> triangles);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  [[nodiscard]] std::optional<RayHit> first_hit(const Vec3& origin, const Vec3& direction) const;
  /// Whether a triangle lies between `eye` and `point`, leaving out the last `tolerance` (a share of the way).
  [[nodiscard]] bool blocked(const Vec3& eye, const Vec3& point, double tolerance) const;

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
};
}  // namespace lbea::bake
