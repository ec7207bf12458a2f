#include "tools/eval/experiment_error.hpp"

#include <cmath>
#include <limits>

namespace lbea::tool {

double experiment_error(std::span<const float> truth, std::span<const float> sample) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < truth.size(); i += 3) {
    const double dx = double{truth[i]} - double{sample[i]}, dy = double{truth[i + 1]} - double{sample[i + 1]},
                 dz = double{truth[i + 2]} - double{sample[i + 2]};
    sum += std::sqrt(dx * dx + dy * dy + dz * dz);
  }
  return sum / static_cast<double>(truth.size() / 3);
}

Oracle oracle(const Model& model, std::span<const float> truth) {
  Oracle best{.error = std::numeric_limits<double>::infinity()};
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const double error = experiment_error(truth, model.node_positions(s));
    if (error < best.error) best = {s, error};
  }
  return best;
}

}  // namespace lbea::tool
