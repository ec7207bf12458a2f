// The steps of a bake as programs take them: lbea-bake's subcommands, and the driver for MPI.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/jobs.hpp"
#include "precompute/model_file/estimate.hpp"
#include "tools/bake/command_line.hpp"

#include <filesystem>

namespace lbea::tool {

/// Progress lines, Ctrl-C, the sensor that `views` describes; broken runs are left out.
[[nodiscard]] bake::BakeOptions step_options(unsigned threads, const std::filesystem::path& views);

/// The description's runs, those of --from taken from that model.
[[nodiscard]] bake::Ensemble ensemble_of(const BakeCommand& command, const bake::EnsembleDescription& description);

/// Writes the plan into `work`.
bake::BakePlan plan_step(const BakeCommand& command, const bake::WorkFolder& work);
/// The share of plan_step() that reads, before it.
void survey_step(const BakeCommand& command, const bake::WorkFolder& work, const bake::Shard& shard);
[[nodiscard]] bake::BakePlan read_plan(const bake::WorkFolder& work);
bake::ShardSummary shard_step(const bake::WorkFolder& work, const bake::BakePlan& plan, const bake::Shard& shard,
                              unsigned threads, bool verifies_finished = false);
/// output: empty for the plan's own.
bake::BakeSummary merge_step(const bake::WorkFolder& work, const bake::BakePlan& plan, std::filesystem::path& output,
                             unsigned threads);

}  // namespace lbea::tool
