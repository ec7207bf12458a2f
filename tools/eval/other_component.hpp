// Components that are not the ensemble's, where the ensemble's stands: what must be told from it.
#pragma once

#include "tools/eval/trial.hpp"

#include <lbea/lbea.hpp>

#include <vector>

namespace lbea::tool {

/// A round tube, a box of another section, a corrugated plate and a ball, in the box of the model's first sample; each
/// is pressed together along its longest side, to 0.6 of it, in as many states as the model's longest simulation has.
[[nodiscard]] std::vector<Experiment> other_components(const Model& model);

}  // namespace lbea::tool
