// One state's triangles before a pinhole camera: what each pixel sees, and what hides points from the camera.
#pragma once

#include "precompute/rig/points_in_view.hpp"
#include "precompute/rig/triangle_projection.hpp"

namespace lbea::bake {

using Triangle = std::array<std::uint32_t, 3>;
inline constexpr std::uint64_t no_triangle = 0xffff'ffff;

/// The nearest surface on the ray through each pixel's centre, row by row from the top left.
struct PixelViews {
  std::size_t stride = 0;               // pixels in memory per row: pairs of pixels may reach beyond the image
  std::vector<double> inverse_depth;    // 1 / z; 0 where there is no surface
  std::vector<std::uint64_t> triangle;  // no_triangle where there is no surface
};

/// Rasterizes triangles, see TriangleProjection.
/// The answers are the same on every machine. Keeps its memory from state to state; for one thread.
class CameraView {
 public:
  /// The plane must outlive the view.
  explicit CameraView(const PinholeImage& plane);

  /// nodes: in camera coordinates, finite where a triangle uses them. The spans must outlive the calls below.
  void place(std::span<const Vec3> nodes, std::span<const Triangle> triangles);

  [[nodiscard]] const PixelViews& nearest();

  /// For each point, in camera coordinates: 1 when it lies in the image and no triangle lies between the eye and the
  /// point, at less than 1 - `tolerance` of the way, so that no surface hides itself by rounding.
  void seen(std::span<const Vec3> points, double tolerance, std::vector<std::uint8_t>& result);

  /// x of the directions (x, y, 1) through the centres of a row's pixels.
  [[nodiscard]] std::span<const double> directions() const { return directions_; }

 private:
  struct Projected {
    Pair at;  // column, row; px
    double inverse_depth;
  };
  /// The pixels whose squares, widened by `margin` px, may meet the triangle; margin 0: whose centres may lie in it.
  [[nodiscard]] PixelBox pixels_around(const Triangle& triangle, double margin) const;
  [[nodiscard]] PixelBox pixels_across_eye(const Triangle& triangle, double margin) const;
  [[nodiscard]] TriangleProjection projection(const Triangle& triangle) const;
  /// Infinite when a part lies in the eye's plane.
  [[nodiscard]] double greatest_inverse_depth(const Triangle& triangle) const;

  const PinholeImage& plane_;
  std::span<const Vec3> nodes_;
  std::span<const Triangle> triangles_;
  std::vector<Projected> projected_;  // of each node
  std::vector<double> directions_;
  PixelViews views_;
  PointsInView points_;
};

}  // namespace lbea::bake
