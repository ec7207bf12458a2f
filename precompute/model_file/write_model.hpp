// The last part of a bake: the samples of all runs, and what is learned from all of them, become one model file.
#pragma once

#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
/// The finished runs, and those that are left out.
struct CollectedRuns {
  BakePlan plan;  // without the runs that are left out
  std::vector<RunLeftOut> left_out;
};

/// Throws Error{bad_input} when a run is not finished or the reference run failed.
[[nodiscard]] CollectedRuns collect_runs(const WorkFolder& work, const BakePlan& plan);

/// Reads the runs' records in the order of the ensemble. Memory: one sample, the bases and 1,024 depth images.
/// Throws DamagedWorkFile, Error{write_failed} and BakeCancelled; the output is complete or absent.
BakeSummary write_model(const WorkFolder& work, const CollectedRuns& runs, const std::filesystem::path& output,
                        const BakeOptions& options);
}  // namespace lbea::bake
