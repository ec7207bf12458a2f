// What a model says about its own making, as JSON.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"
#include "precompute/survey/survey.hpp"

#include <string>
#include <vector>

namespace lbea::bake {

/// Depends on the inputs alone: no paths, times of day, machines or numbers of threads.
/// kept_variance: NaN becomes null. left_out: names of runs that could not be read; without any there is no word of it.
[[nodiscard]] std::string provenance_json(const EnsembleDescription& description, const Ensemble& ensemble,
                                          const Survey& survey, const std::vector<ReferenceBasis>& references,
                                          double kept_variance, const std::vector<std::string>& left_out);

}  // namespace lbea::bake
