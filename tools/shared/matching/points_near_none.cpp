#include "tools/shared/matching/points_near_none.hpp"

#include "tools/shared/matching/transformed.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {

PointsNearNone::PointsNearNone(const std::vector<Model>& components, const MatcherConfig& config)
    : T_reference_sensor_(config.T_reference_sensor),
      is_near_(components.size(), std::vector<std::uint8_t>(config.max_points)) {
  for (const Model& model : components) envelopes_.push_back(envelope_grid(model.view().envelope));
}

void PointsNearNone::mark(std::size_t component, std::span<const Point> points) noexcept {
  std::vector<std::uint8_t>& is_near = is_near_[component];
  if (points.size() > is_near.size()) return;
  const CellGrid& envelope = envelopes_[component];
  std::ranges::transform(points, is_near.begin(), [&](const Point& point) {
    const Point placed = transformed(T_reference_sensor_, point);
    return static_cast<std::uint8_t>(envelope.rank_of({placed.x, placed.y, placed.z}) != CellGrid::outside);
  });
}

std::uint32_t PointsNearNone::count(std::span<const Point> points) const noexcept {
  if (points.size() > is_near_.front().size()) return 0;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint8_t is_near = 0;
    for (const std::vector<std::uint8_t>& of_component : is_near_) is_near |= of_component[i];
    const Point& point = points[i];
    const bool is_finite = std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
    count += is_near == 0 && is_finite ? 1 : 0;
  }
  return count;
}

}  // namespace lbea::tool
