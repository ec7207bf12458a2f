// EE, the error of a match for an experiment whose true mesh is known (eq. 4), and the best any sample can do.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <span>

namespace lbea::tool {

/// Eq. 4: mean over the nodes of the whole mesh of |s^e_i - s*_i|, in the length unit. Both: nodes x 3.
[[nodiscard]] double experiment_error(std::span<const float> truth, std::span<const float> sample);

struct Oracle {
  std::uint32_t sample = 0;
  double error = 0;
};
/// The sample with the least EE: no method that picks a sample can do better. Ties to the lower index.
[[nodiscard]] Oracle oracle(const Model& model, std::span<const float> truth);

}  // namespace lbea::tool
