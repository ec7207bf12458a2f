#include "tools/report/content/comparison/cloud_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lbea::tool {

CloudComparison::CloudComparison(std::span<const Point> points, std::span<const float> positions,
                                 std::span<const std::array<std::uint32_t, 4>> elements, double reach)
    : point_distances_(points.size(), unknown),
      element_distances_(elements.size(), unknown),
      element_points_(elements.size(), 0) {
  const bake::SurfaceTree surface(positions, elements);
  std::vector<double> sums(elements.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto place = surface.nearest({double{points[i].x}, double{points[i].y}, double{points[i].z}}, reach);
    if (!place.found()) continue;
    point_distances_[i] = static_cast<float>(place.distance);
    sums[place.element] += place.distance;
    ++element_points_[place.element];
    sorted_.push_back(point_distances_[i]);
  }
  for (std::size_t e = 0; e < elements.size(); ++e)
    if (element_points_[e] > 0) element_distances_[e] = static_cast<float>(sums[e] / element_points_[e]);
  std::ranges::sort(sorted_);
}

double CloudComparison::mean() const noexcept {
  if (sorted_.empty()) return double{unknown};
  return std::accumulate(sorted_.begin(), sorted_.end(), 0.0) / static_cast<double>(sorted_.size());
}

double CloudComparison::quantile(double share) const noexcept {
  if (sorted_.empty()) return double{unknown};
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(sorted_.size() - 1);
  return double{sorted_[static_cast<std::size_t>(std::lround(at))]};
}

}  // namespace lbea::tool
