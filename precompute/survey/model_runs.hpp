// Runs that are opened from a finished model, whose mesh may lack what the new common mesh has.
#pragma once

#include "precompute/survey/survey.hpp"

namespace lbea::bake {

/// Whether all runs have, by their own files, an element that some run shows and the model does not have. reference: of
/// plan.ensemble. plan: with surveys.
[[nodiscard]] bool model_lacks_elements(const WorkFolder& work, const BakePlan& plan, const SimulationMesh& reference);

/// All runs open from their own files.
[[nodiscard]] Ensemble from_own_files(Ensemble ensemble);

}  // namespace lbea::bake
