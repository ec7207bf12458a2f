// The steps of a bake as programs take them: lbea-bake's subcommands, and the driver for MPI.
#pragma once

#include "precompute/bake_summary.hpp"
#include "precompute/jobs/bake_shard.hpp"
#include "precompute/jobs/estimate.hpp"
#include "precompute/jobs/run_status.hpp"
#include "tools/bake/command_line.hpp"

#include <filesystem>

namespace lbea {

/// Progress lines, Ctrl-C, the sensor that `views` describes; broken runs are left out.
[[nodiscard]] BakeOptions step_options(unsigned threads, const std::filesystem::path& views);

/// The description's runs, those of --from taken from that model.
[[nodiscard]] Ensemble ensemble_of(const BakeCommand& command, const EnsembleDescription& description);

/// Writes the plan into `work`.
BakePlan plan_step(const BakeCommand& command, const WorkFolder& work);
/// The share of plan_step() that reads, before it.
void survey_step(const BakeCommand& command, const WorkFolder& work, const Shard& shard);
[[nodiscard]] BakePlan read_plan(const WorkFolder& work);
ShardSummary shard_step(const WorkFolder& work, const BakePlan& plan, const Shard& shard, unsigned threads, bool verifies_finished = false);
/// output: empty for the plan's own.
BakeSummary merge_step(const WorkFolder& work, const BakePlan& plan, std::filesystem::path& output, unsigned threads);

}  // namespace lbea
