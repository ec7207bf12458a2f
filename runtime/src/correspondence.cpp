#include "runtime/src/correspondence.hpp"

#include <algorithm>

namespace lbea {

namespace {

constexpr std::size_t group = CloudIndex::fanout;

// Sixteen positions as planes; beyond the end the last one again.
struct Group {
  float planes[3][group];

  Group(std::span<const std::array<float, 3>> positions, std::size_t begin) {
    for (std::size_t i = 0; i < group; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = positions[std::min(begin + i, positions.size() - 1)][axis];
  }
};

NearestPoints within(float squared) {
  NearestPoints bound;
  std::ranges::fill(bound.squared, squared);
  std::ranges::fill(bound.point, NearestPoint::none);
  std::ranges::fill(bound.slot, NearestPoint::none);
  return bound;
}

using Search = void (CloudIndex::*)(const float* const[3], const std::uint32_t*, NearestPoints&) const noexcept;

// Calls each(first vertex, answers) for the positions 16 by 16. `guess(i)`: where the answer for i may be.
template <Search search_16, typename Guess, typename Each>
void search(const CloudIndex& index, std::span<const std::array<float, 3>> positions, float squared, Guess guess, Each each) {
  for (std::size_t begin = 0; begin < positions.size(); begin += group) {
    const Group queries(positions, begin);
    const float* const planes[3] = {queries.planes[0], queries.planes[1], queries.planes[2]};
    std::uint32_t hints[group];
    for (std::size_t i = 0; i < group; ++i) hints[i] = index.hint(guess(std::min(begin + i, positions.size() - 1)));
    NearestPoints nearest = within(squared);
    (index.*search_16)(planes, hints, nearest);
    each(begin, nearest);
  }
}

}  // namespace

void correspond(const CloudIndex& index, std::span<const std::array<float, 3>> vertices, Positions& corresponding,
                std::span<std::uint32_t> points) noexcept {
  constexpr float anywhere = std::numeric_limits<float>::infinity();
  const auto guess = [&](std::size_t v) { return corresponding[v]; };
  search<&CloudIndex::nearest_16>(index, vertices, anywhere, guess, [&](std::size_t begin, const NearestPoints& nearest) {
    for (std::size_t i = 0; i < std::min(group, vertices.size() - begin); ++i) {
      corresponding.set(begin + i, index.position(nearest.slot[i]));
      if (!points.empty()) points[begin + i] = nearest.point[i];
    }
  });
}

float coverage(const CloudIndex& index, std::span<const std::array<float, 3>> positions, std::span<const double> mass,
               float trusted_distance) noexcept {
  double seen = 0, all = 0;
  const auto guess = [&](std::size_t v) { return positions[v]; };
  search<&CloudIndex::any_16>(index, positions, trusted_distance * trusted_distance, guess, [&](std::size_t begin, const NearestPoints& nearest) {
    for (std::size_t i = 0; i < std::min(group, positions.size() - begin); ++i) {
      all += mass[begin + i];
      if (nearest.point[i] != NearestPoint::none) seen += mass[begin + i];
    }
  });
  return static_cast<float>(seen / all);
}

}  // namespace lbea
