#include "runtime/src/correspondence.hpp"

namespace lbea {

namespace {

// What an answer found for another query means for this one.
NearestPoint seen_from(const std::array<float, 3>& query, NearestPoint answer) noexcept {
  if (answer.point == NearestPoint::none) return {};
  const float dx = answer.x - query[0], dy = answer.y - query[1], dz = answer.z - query[2];
  answer.squared = dx * dx + dy * dy + dz * dz;  // as the search sums, so that the same point compares equal
  return answer;
}

}  // namespace

void correspond(const CloudIndex& index, std::span<const std::array<float, 3>> vertices, Positions& corresponding,
                std::span<std::uint32_t> points) noexcept {
  NearestPoint nearest;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    nearest = index.nearest(vertices[v], seen_from(vertices[v], nearest));
    corresponding.set(v, {nearest.x, nearest.y, nearest.z});
    if (!points.empty()) points[v] = nearest.point;
  }
}

float coverage(const CloudIndex& index, std::span<const std::array<float, 3>> positions, std::span<const double> mass,
               float trusted_distance) noexcept {
  const NearestPoint within{.squared = trusted_distance * trusted_distance};
  double seen = 0, all = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    all += mass[v];
    if (index.nearest(positions[v], within).point != NearestPoint::none) seen += mass[v];
  }
  return static_cast<float>(seen / all);
}

}  // namespace lbea
