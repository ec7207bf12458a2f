// Method step 2, first pass over the runs: the mesh common to all samples and the box of all their positions.
#pragma once

#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {

/// Checks the ensemble, surveys every run that has not been surveyed, and combines the surveys into a new plan, without
/// bases. The work folder is created. Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
[[nodiscard]] BakePlan survey_runs(const WorkFolder& work, const Ensemble& ensemble,
                                   const EnsembleDescription& description, const BakeOptions& options);

/// Only the part that reads, of some runs; survey_runs() finds the surveys later.
void survey_some(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                 const std::vector<std::size_t>& runs, const BakeOptions& options);

}  // namespace lbea::bake
