// Method step 2: the reference run at the states that become reference meshes, and their bases.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/bake_plan.hpp"

#include <cstdint>
#include <vector>

namespace lbea::bake {

/// The keys of the plan's bases: solved and written to the work folder unless they are there.
[[nodiscard]] std::vector<std::uint64_t> make_bases(const WorkFolder& work, const Ensemble& ensemble,
                                                    const EnsembleDescription& description, const Survey& survey,
                                                    const BakeOptions& options);

}  // namespace lbea::bake
