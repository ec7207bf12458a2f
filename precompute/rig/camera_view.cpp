#include "precompute/rig/camera_view.hpp"

#include <algorithm>
#include <limits>

namespace lbea::bake {
namespace {

constexpr double rounding = 1e-6;        // px
constexpr double depth_rounding = 1e-9;  // relative

/// Replaces the inverse depths and triangles of the pixels of a row where the triangle is nearer, pair by pair.
void draw(const TriangleProjection::Row& triangle, std::uint64_t number, const double* x, std::size_t count,
          double* inverse_depth, std::uint64_t* numbers) {
  const PairMask number_pair = PairMask{} + static_cast<std::int64_t>(number);
  for (std::size_t i = 0; i < count; i += 2) {
    const Pair at = load_pair(x + i), here = triangle.inverse_depth(at), before = load_pair(inverse_depth + i);
    const PairMask is_nearer = triangle.contains(at) & (here > before);
    store_pair(inverse_depth + i, choose(is_nearer, here, before));
    store_mask(numbers + i, choose(is_nearer, number_pair, load_mask(numbers + i)));
  }
}

/// The pixels whose squares, widened by `margin` px, meet the box from low to high; margin 0: whose centres lie in it.
PixelBox pixels_between(Pair low, Pair high, double margin, const PinholeImage& plane) {
  const Pair most{static_cast<double>(plane.width()), static_cast<double>(plane.height())};
  const auto inside = [&](Pair at) { return lesser(greater(at, Pair{}), most); };
  const Pair begin = inside(low + (0.5 - margin - rounding)), end = inside(high + (0.5 + margin + rounding));
  const auto pixel = [](double at) { return static_cast<std::uint32_t>(at); };  // truncated: none is negative
  return {{pixel(begin[0]), pixel(end[0])}, {pixel(begin[1]), pixel(end[1])}};
}

}  // namespace

CameraView::CameraView(const PinholeImage& plane) : plane_(plane), directions_(plane.width() + 1) {
  for (std::uint32_t column = 0; column <= plane.width(); ++column) directions_[column] = plane.direction(column, 0).x;
  views_.stride = plane.width() + 1;
}

void CameraView::place(std::span<const Vec3> nodes, std::span<const Triangle> triangles) {
  nodes_ = nodes;
  triangles_ = triangles;
  projected_.resize(nodes.size());
  std::ranges::transform(nodes, projected_.begin(), [&](const Vec3& node) {
    return Projected{{plane_.column_of(node), plane_.row_of(node)}, 1 / node.z};
  });
}

/// Of a triangle that extends behind the eye. Its image is bounded on the sides that it does not cross the eye's plane
/// towards.
PixelBox CameraView::pixels_across_eye(const Triangle& triangle, double margin) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Pair low = Pair{} + infinity, high = -low;
  for (const std::uint32_t i : triangle) {
    if (!(nodes_[i].z > 0)) continue;
    low = lesser(low, projected_[i].at);
    high = greater(high, projected_[i].at);
    for (const std::uint32_t j : triangle) {
      const Vec3 &front = nodes_[i], &behind = nodes_[j];
      if (behind.z > 0) continue;
      // where the edge crosses the plane, times a positive number
      const Pair crossing = Pair{front.x, front.y} * -behind.z + Pair{behind.x, behind.y} * front.z;
      const Pair error = depth_rounding * norm(front) * norm(behind) + Pair{};
      low = crossing < error ? -infinity + Pair{} : low;
      high = crossing > -error ? infinity + Pair{} : high;
    }
  }
  return pixels_between(low, high, margin, plane_);
}

PixelBox CameraView::pixels_around(const Triangle& triangle, double margin) const {
  const auto& [a, b, c] = triangle;
  const double nearest = std::min({nodes_[a].z, nodes_[b].z, nodes_[c].z});
  if (!(nearest > 0)) return pixels_across_eye(triangle, margin);
  const Pair p = projected_[a].at, q = projected_[b].at, r = projected_[c].at;
  return pixels_between(lesser(p, lesser(q, r)), greater(p, greater(q, r)), margin, plane_);
}

const PixelViews& CameraView::nearest() {
  views_.inverse_depth.assign(views_.stride * plane_.height() + 1, 0.0);
  views_.triangle.assign(views_.inverse_depth.size(), no_triangle);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const PixelBox box = pixels_around(triangles_[t], 0);
    if (box.is_empty()) continue;
    const TriangleProjection triangle = projection(triangles_[t]);
    if (triangle.is_degenerate()) continue;
    for (std::uint32_t row = box.rows.begin; row < box.rows.end; ++row) {
      const std::size_t first = row * views_.stride + box.columns.begin;
      draw({triangle, plane_.direction(0, row).y}, t, &directions_[box.columns.begin],
           box.columns.end - box.columns.begin, &views_.inverse_depth[first], &views_.triangle[first]);
    }
  }
  return views_;
}

void CameraView::seen(std::span<const Vec3> points, double tolerance, std::vector<std::uint8_t>& result) {
  points_.place(plane_, points, tolerance);
  for (const Triangle& corners : triangles_) {
    const PixelBox box = pixels_around(corners, 0.5);
    if (box.is_empty() || !points_.can_hide(box, greatest_inverse_depth(corners))) continue;
    const TriangleProjection triangle = projection(corners);
    if (!triangle.is_degenerate()) points_.cover(triangle, box);
  }
  points_.seen(result);
}

TriangleProjection CameraView::projection(const Triangle& triangle) const {
  return {nodes_[triangle[0]], nodes_[triangle[1]], nodes_[triangle[2]]};
}

double CameraView::greatest_inverse_depth(const Triangle& triangle) const {
  double greatest = 0;
  for (const std::uint32_t node : triangle) {
    if (!(nodes_[node].z > 0)) return std::numeric_limits<double>::infinity();
    greatest = std::max(greatest, projected_[node].inverse_depth);
  }
  return greatest * (1 + depth_rounding);
}

}  // namespace lbea::bake
