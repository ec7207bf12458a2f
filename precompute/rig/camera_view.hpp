// One state's triangles before a pinhole camera: what each pixel sees, and what hides points from the camera.
#pragma once

#include "precompute/rig/camera.hpp"

namespace lbea::bake {

using Triangle = std::array<std::uint32_t, 3>;
inline constexpr std::uint64_t no_triangle = 0xffff'ffff;

/// The nearest surface on the ray through each pixel's centre, row by row from the top left.
struct PixelViews {
  std::vector<double> inverse_depth;    // 1 / z; 0 where there is no surface
  std::vector<std::uint64_t> triangle;  // no_triangle where there is no surface
};

/// Rasterizes in homogeneous coordinates (Olano and Greer 1997): a ray d from the eye meets the triangle a, b, c where
/// (a x b) d, (b x c) d and (c x a) d have the same sign, and there 1 / z = n d / (n a). Both are linear in d, need no
/// clipping, and are the same for the two triangles of an edge: no ray passes between them.
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

 private:
  struct ImagePoint {
    double column, row;  // px
  };
  /// Columns or rows from begin to before end.
  struct Range {
    std::uint32_t begin, end;
    [[nodiscard]] bool is_empty() const { return begin >= end; }
  };
  struct Box {
    Range columns, rows;
  };
  /// Points in the image, sorted by pixel.
  struct SortedPoints {
    std::vector<std::uint32_t> pixel;  // of each point; no_pixel outside the image
    std::vector<std::uint32_t> begin;  // of each pixel, and the end of the last
    std::vector<std::uint32_t> next;   // free place of each pixel
    std::vector<std::uint32_t> place;  // of each point
    std::vector<double> x, y;          // direction (x, y, 1)
    std::vector<double> nearest;       // 1 / z of the nearest surface in this direction, 0: none
  };

  [[nodiscard]] Box pixels_around(const Triangle& triangle, double margin) const;
  /// Calls draw(number of the triangle, Projection, row, columns) for the pixels around every triangle.
  template <class Draw>
  void for_each_row(double margin, const Draw& draw) const;
  void sort(std::span<const Vec3> points);

  const PinholeImage& plane_;
  std::span<const Vec3> nodes_;
  std::span<const Triangle> triangles_;
  std::vector<ImagePoint> projected_;  // of each node
  std::vector<double> directions_;     // x of each column
  PixelViews views_;
  SortedPoints points_;
};

}  // namespace lbea::bake
