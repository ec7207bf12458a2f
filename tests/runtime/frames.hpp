// Frames made of a model's own samples.
#pragma once

#include <lbea/lbea.hpp>

#include <vector>

namespace lbea::test {

inline std::vector<Point> points_of(const Model& model, std::uint32_t sample) {
  const auto positions = model.node_positions(sample);
  std::vector<Point> points;
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
    points.push_back({positions[i], positions[i + 1], positions[i + 2]});
  return points;
}

}  // namespace lbea::test
