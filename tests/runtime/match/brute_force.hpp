// The oracle: every point against the query, ties to the lower place.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace lbea::test {

using Position = std::array<float, 3>;

struct BruteForce {
  std::size_t point = 0;
  double squared = 1e300;
};

inline BruteForce brute_force(std::span<const Position> points, const Position& query) {
  BruteForce best;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double difference = double{points[i][axis]} - double{query[axis]};
      squared += difference * difference;
    }
    if (squared < best.squared) best = {i, squared};
  }
  return best;
}

inline std::vector<Position> random_positions(std::size_t count, float extent, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> coordinate(-extent, extent);
  std::vector<Position> positions(count);
  for (auto& p : positions) p = {coordinate(random), coordinate(random), coordinate(random)};
  return positions;
}

}  // namespace lbea::test
