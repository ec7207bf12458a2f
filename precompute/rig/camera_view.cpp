#include "precompute/rig/camera_view.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lbea::bake {
namespace {

constexpr double rounding = 1e-6;      // px
constexpr double least_share = 1e-10;  // of a sum in its summands: below it, rounding matters
constexpr std::uint32_t no_pixel = 0xffff'ffff;

struct Linear {
  double factor, constant;

  double operator()(double x) const { return factor * x + constant; }
};

/// A triangle as functions of a ray's direction (x, y, 1).
class Projection {
 public:
  /// Degenerate when the eye lies in the triangle's plane, up to rounding.
  Projection(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
    const Vec3 normal = cross(b - a, c - a);
    const double volume = dot(normal, a);
    const double summands = std::abs(normal.x * a.x) + std::abs(normal.y * a.y) + std::abs(normal.z * a.z);
    is_degenerate_ = !(std::abs(volume) > least_share * summands) || !std::isfinite(volume);
    const double sign = volume > 0 ? 1 : -1;
    edges_ = {scaled(ab, sign), scaled(bc, sign), scaled(ca, sign)};
    inverse_depth_ = scaled(normal, 1 / volume);
  }
  [[nodiscard]] bool is_degenerate() const { return is_degenerate_; }

  /// The same functions in one row of pixels, of x alone.
  struct Row {
    Linear e, f, g;  // edges
    Linear inverse_depth;

    /// 1 / z of the triangle; 0 beside it.
    [[nodiscard]] double operator()(double x) const {
      const double ex = e(x), fx = f(x), gx = g(x), here = inverse_depth(x);
      const double least_of_two = ex < fx ? ex : fx, least = least_of_two < gx ? least_of_two : gx;
      return least >= 0 ? here : 0.0;
    }
  };
  [[nodiscard]] Row row(double y) const {
    const auto in_row = [y](const Vec3& v) { return Linear{v.x, v.y * y + v.z}; };
    return {in_row(edges_[0]), in_row(edges_[1]), in_row(edges_[2]), in_row(inverse_depth_)};
  }

 private:
  static Vec3 scaled(const Vec3& v, double factor) { return {factor * v.x, factor * v.y, factor * v.z}; }

  bool is_degenerate_ = false;
  std::array<Vec3, 3> edges_;  // none negative: inside
  Vec3 inverse_depth_;
};

/// Replaces the inverse depths and triangles of pixels of a row where the triangle is nearer.
void draw(const Projection::Row& triangle, std::uint64_t number, const double* x, std::size_t count,
          double* __restrict inverse_depth, std::uint64_t* __restrict numbers) {
  for (std::size_t i = 0; i < count; ++i) {
    const double here = triangle(x[i]), before = inverse_depth[i];
    const std::uint64_t number_before = numbers[i];
    inverse_depth[i] = here > before ? here : before;
    numbers[i] = here > before ? number : number_before;
  }
}

/// Replaces the inverse depths of points where the triangle is nearer.
void cover(const Projection& triangle, std::size_t count, const double* x, const double* y,
           double* __restrict inverse_depth) {
  for (std::size_t i = 0; i < count; ++i) {
    const double here = triangle.row(y[i])(x[i]), before = inverse_depth[i];
    inverse_depth[i] = here > before ? here : before;
  }
}

}  // namespace

CameraView::CameraView(const PinholeImage& plane) : plane_(plane), directions_(plane.width()) {
  for (std::uint32_t column = 0; column < plane.width(); ++column) directions_[column] = plane.direction(column, 0).x;
}

void CameraView::place(std::span<const Vec3> nodes, std::span<const Triangle> triangles) {
  nodes_ = nodes;
  triangles_ = triangles;
  projected_.resize(nodes.size());
  std::ranges::transform(nodes, projected_.begin(), [&](const Vec3& node) {
    return ImagePoint{plane_.column_of(node), plane_.row_of(node)};
  });
}

/// margin: 1/2 for pixels whose squares touch the triangle, 0 for pixels whose centres may lie in it.
CameraView::Box CameraView::pixels_around(const Triangle& triangle, double margin) const {
  const auto& [a, b, c] = triangle;
  const double nearest = std::min(nodes_[a].z, std::min(nodes_[b].z, nodes_[c].z));
  const double farthest = std::max(nodes_[a].z, std::max(nodes_[b].z, nodes_[c].z));
  if (!(farthest > 0)) return {{0, 0}, {0, 0}};
  if (!(nearest > 0)) return {{0, plane_.width()}, {0, plane_.height()}};  // across the plane of the eye
  const auto range = [margin](double i, double j, double k, std::uint32_t count) {
    const double low = std::min(i, std::min(j, k)), high = std::max(i, std::max(j, k));
    const double most = count;  // truncated below, as no number is negative
    return Range{static_cast<std::uint32_t>(std::clamp(low + 0.5 - margin - rounding, 0.0, most)),
                 static_cast<std::uint32_t>(std::clamp(high + 0.5 + margin + rounding, 0.0, most))};
  };
  const ImagePoint &p = projected_[a], &q = projected_[b], &r = projected_[c];
  return {range(p.column, q.column, r.column, plane_.width()), range(p.row, q.row, r.row, plane_.height())};
}

template <class Draw>
void CameraView::for_each_row(double margin, const Draw& draw) const {
  for (std::uint64_t t = 0; t < triangles_.size(); ++t) {
    const auto [columns, rows] = pixels_around(triangles_[t], margin);
    if (columns.is_empty() || rows.is_empty()) continue;
    const auto& [a, b, c] = triangles_[t];
    const Projection triangle(nodes_[a], nodes_[b], nodes_[c]);
    if (triangle.is_degenerate()) continue;
    for (std::uint32_t row = rows.begin; row < rows.end; ++row) draw(t, triangle, row, columns);
  }
}

const PixelViews& CameraView::nearest() {
  views_.inverse_depth.assign(plane_.pixels(), 0.0);
  views_.triangle.assign(plane_.pixels(), no_triangle);
  for_each_row(0, [&](std::uint64_t number, const Projection& triangle, std::uint32_t row, const Range& columns) {
    const std::size_t first = std::size_t{row} * plane_.width() + columns.begin;
    draw(triangle.row(plane_.direction(0, row).y), number, &directions_[columns.begin], columns.end - columns.begin,
         &views_.inverse_depth[first], &views_.triangle[first]);
  });
  return views_;
}

void CameraView::sort(std::span<const Vec3> points) {
  auto& [pixel, begin, next, place, x, y, nearest] = points_;
  pixel.resize(points.size());
  place.resize(points.size());
  begin.assign(plane_.pixels() + 1, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    pixel[i] = plane_.sees(points[i]) ? static_cast<std::uint32_t>(plane_.row_of(points[i])) * plane_.width() +
                                            static_cast<std::uint32_t>(plane_.column_of(points[i]))
                                      : no_pixel;
    if (pixel[i] != no_pixel) ++begin[pixel[i] + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  x.resize(begin.back());
  y.resize(begin.back());
  nearest.assign(begin.back(), 0.0);
  next = begin;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (pixel[i] == no_pixel) continue;
    const Vec3& p = points[i];
    place[i] = next[pixel[i]]++;
    x[place[i]] = p.x / p.z;
    y[place[i]] = p.y / p.z;
  }
}

void CameraView::seen(std::span<const Vec3> points, double tolerance, std::vector<std::uint8_t>& result) {
  sort(points);
  for_each_row(0.5, [&](std::uint64_t, const Projection& triangle, std::uint32_t row, const Range& columns) {
    const std::size_t first = std::size_t{row} * plane_.width();
    const std::uint32_t begin = points_.begin[first + columns.begin], end = points_.begin[first + columns.end];
    cover(triangle, end - begin, points_.x.data() + begin, points_.y.data() + begin, points_.nearest.data() + begin);
  });
  result.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    result[i] = points_.pixel[i] != no_pixel && points_.nearest[points_.place[i]] * points[i].z * (1 - tolerance) <= 1;
}

}  // namespace lbea::bake
