// The last of a bake's three steps: the records become one model.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/bake_summary.hpp"
#include "precompute/jobs/bake_plan.hpp"

#include <filesystem>

namespace lbea::bake {

/// Streams the runs' records in the order of the ensemble: one sample in memory, and what the bases and 1,024 depth
/// images take. What all samples decide together is learnt on the way. Failed runs are left out and named.
/// Throws Error{bad_input} naming runs that are not finished and files that are damaged, Error{write_failed} and
/// BakeCancelled; the output is whole or not there, the work folder stays, without
/// what writers that died left in it.
BakeSummary merge_shards(const WorkFolder& work, const BakePlan& plan, const std::filesystem::path& output,
                         const BakeOptions& options);

}  // namespace lbea::bake
