// Points before a pinhole camera, sorted by pixel, and whether triangles hide them.
#pragma once

#include "precompute/rig/triangle_projection.hpp"

namespace lbea::bake {

/// Columns or rows from begin to before end.
struct PixelRange {
  std::uint32_t begin, end;
  [[nodiscard]] bool is_empty() const { return begin >= end; }
};
struct PixelBox {
  PixelRange columns, rows;
  [[nodiscard]] bool is_empty() const { return columns.is_empty() || rows.is_empty(); }
};

/// Keeps its memory from points to points.
class PointsInView {
 public:
  /// points: in camera coordinates; the span must outlive the calls below. tolerance: see CameraView::seen().
  void place(const PinholeImage& plane, std::span<const Vec3> points, double tolerance);

  /// Whether a surface with at most this inverse depth can hide a point in the box: false for most of what lies behind
  /// others.
  [[nodiscard]] bool can_hide(const PixelBox& box, double inverse_depth) const;
  /// Notes which points in the box the triangle hides.
  void cover(const TriangleProjection& triangle, const PixelBox& box);
  /// For each point: 1 when it lies in the image and nothing hides it.
  void seen(std::vector<std::uint8_t>& result) const;

 private:
  void find_pixels(const PinholeImage& plane);
  void sort_by_pixel();
  [[nodiscard]] std::size_t tile_of(std::size_t column, std::size_t row) const;

  std::span<const Vec3> points_;
  double farthest_hidden_ = 1;         // share of a point's depth up to which surfaces hide it
  std::size_t width_ = 0, tiles_ = 0;  // per row: pixels, tiles
  std::vector<std::uint32_t> pixel_;   // of each point; no_pixel outside the image
  std::vector<std::uint32_t> begin_;   // places of each pixel's points, and the end of the last
  std::vector<std::uint32_t> place_;   // of each point
  std::vector<double> x_, y_;          // per place: direction (x, y, 1)
  std::vector<double> nearest_;        // per place: 1 / z of the nearest surface, not less than hides nothing
  std::vector<double> least_;          // per tile: of the least that hides something
};

}  // namespace lbea::bake
