// Measures the time of the parts of method fit by number of samples, cells and candidates.
#pragma once

#include "tools/bench/growth.hpp"

namespace lbea::tool::bench {

/// The comparison of thinned images with all samples and simple loops, for 300 to 30,000 samples: the model's,
/// repeated. Throws Error{bad_input} if the least residuals differ by more than rounding.
[[nodiscard]] std::vector<GrowthRow> growth_of_proposals(const Model& model, std::span<const BenchCloud> clouds,
                                                         const RigidTransform& T_reference_sensor);

/// The ranking of the proposed samples and simple loops over all cells, for depth images that are resampled to 1/4 to
/// 16 times the cells of the model's. Throws Error{bad_input} if the best samples differ.
[[nodiscard]] std::vector<GrowthRow> growth_with_cells(const Model& model, const MatcherConfig& config,
                                                       std::span<const BenchCloud> clouds);

/// Method fit after the index, for 6 to 96 candidates.
[[nodiscard]] std::vector<GrowthRow> growth_with_candidates(const Model& model, const MatcherConfig& config,
                                                            std::span<const BenchCloud> clouds);

}  // namespace lbea::tool::bench
