#include "precompute/rig/points_in_view.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::bake {
namespace {
constexpr std::uint32_t no_pixel = 0xffff'ffff;
constexpr std::size_t tile = 8;  // pixels along each side
/// Below 1, so that what hides a point is always nearer, whatever the rounding.
constexpr double nearly = 1 - 1e-9;
}  // namespace

void PointsInView::place(const PinholeImage& plane, std::span<const Vec3> points, double tolerance) {
  points_ = points;
  farthest_hidden_ = 1 - tolerance;
  width_ = plane.width();
  tiles_ = width_ / tile + 1;
  least_.assign(tiles_ * (plane.height() / tile + 1), std::numeric_limits<double>::infinity());
  begin_.assign(plane.pixels() + 2, 0);
  find_pixels(plane);
  sort_by_pixel();
}

/// Counts the points of pixel i in begin_[i + 2].
void PointsInView::find_pixels(const PinholeImage& plane) {
  pixel_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    pixel_[i] = no_pixel;
    const Vec3& point = points_[i];
    const double column = plane.column_of(point), row = plane.row_of(point);
    if (!plane.sees(point, column, row)) continue;
    const auto c = static_cast<std::uint32_t>(column), r = static_cast<std::uint32_t>(row);
    pixel_[i] = r * plane.width() + c;
    ++begin_[std::size_t{pixel_[i]} + 2];
    double& least = least_[tile_of(c, r)];
    least = std::min(least, nearly / (point.z * farthest_hidden_));
  }
}

void PointsInView::sort_by_pixel() {
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  const std::size_t places = begin_.back() + 1;  // pairs of points may reach beyond the last
  for (auto* values : {&x_, &y_, &nearest_}) values->resize(places);
  place_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (pixel_[i] == no_pixel) continue;
    const Vec3& point = points_[i];
    const std::uint32_t place = place_[i] = begin_[std::size_t{pixel_[i]} + 1]++;
    x_[place] = point.x / point.z;
    y_[place] = point.y / point.z;
    nearest_[place] = nearly / (point.z * farthest_hidden_);
  }
}

std::size_t PointsInView::tile_of(std::size_t column, std::size_t row) const {
  return row / tile * tiles_ + column / tile;
}

bool PointsInView::can_hide(const PixelBox& box, double inverse_depth) const {
  for (std::size_t row = box.rows.begin / tile; row * tile < box.rows.end; ++row)
    for (std::size_t column = box.columns.begin / tile; column * tile < box.columns.end; ++column)
      if (least_[row * tiles_ + column] < inverse_depth) return true;
  return false;
}

void PointsInView::cover(const TriangleProjection& triangle, const PixelBox& box) {
  for (std::size_t row = box.rows.begin; row < box.rows.end; ++row) {
    const std::uint32_t* const begin = &begin_[row * width_];
    const std::uint32_t end = begin[box.columns.end];
    for (std::uint32_t i = begin[box.columns.begin]; i < end; i += 2) {
      const Pair x = load_pair(&x_[i]), y = load_pair(&y_[i]);
      const Pair here = triangle.inverse_depth(x, y), before = load_pair(&nearest_[i]);
      const PairMask is_nearer = here > before;
      if (any(is_nearer)) store_pair(&nearest_[i], choose(is_nearer & triangle.contains(x, y), here, before));
    }
  }
}

void PointsInView::seen(std::vector<std::uint8_t>& result) const {
  result.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i)
    result[i] = pixel_[i] != no_pixel && nearest_[place_[i]] * points_[i].z * farthest_hidden_ <= 1;
}

}  // namespace lbea::bake
