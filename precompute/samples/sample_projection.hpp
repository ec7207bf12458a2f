// Second pass over the runs, in parallel. Method steps 3 and 5: correspondence and coefficients of every sample on
// every reference mesh; then its depth image.
#pragma once

#include "precompute/samples/sample_record.hpp"

namespace lbea::bake {

/// The runs that were surveyed.
[[nodiscard]] std::vector<std::size_t> surveyed_runs(const BakePlan& plan);

/// Sets the camera of the depth images, and the keys of the runs' files. plan: with survey and bases.
void plan_samples(BakePlan& plan, const BakeOptions& options);

/// Writes the record, and grid and images, of each of these runs unless they are in the work folder already. Returns
/// the number of broken runs; their failures are noted in the work folder. Throws Error{bad_config | bad_input |
/// write_failed} and BakeCancelled.
std::size_t make_samples(const WorkFolder& work, const BakePlan& plan, const std::vector<std::size_t>& runs,
                         const BakeOptions& options);

}  // namespace lbea::bake
