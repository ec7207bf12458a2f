// The space that the samples of a model fill.
#pragma once

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace lbea::tool {

struct SampleBox {
  std::array<float, 3> low, high;
};

[[nodiscard]] inline SampleBox box_of_samples(const Model& model) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  SampleBox box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto positions = model.node_positions(s);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      box.low[i % 3] = std::min(box.low[i % 3], positions[i]);
      box.high[i % 3] = std::max(box.high[i % 3], positions[i]);
    }
  }
  return box;
}

}  // namespace lbea::tool
