// The steps of a bake, called by lbea-bake, its subcommands and the MPI driver.
#pragma once

#include "precompute/bake.hpp"
#include "precompute/jobs/jobs.hpp"
#include "precompute/model_file/estimate.hpp"
#include "tools/bake/command_line.hpp"

namespace lbea::tool {

/// The runs that `file` holds, by name and by names and sizes of their files, are opened from it; the reference run is
/// read itself. The survey goes back to the runs' own files when `file` lacks elements that they have and others show.
/// Throws Model::open()'s errors, and Error{bad_config} when length units or time factors do not fit.
void take_from_model(bake::Ensemble& ensemble, const bake::EnsembleDescription& description,
                     const std::filesystem::path& file);

/// Opens what EnsembleRun::source says: a run's path, or a simulation of a model.
[[nodiscard]] std::unique_ptr<bake::SimulationReader> open_source(const std::string& source);

/// Options with progress lines, Ctrl-C and the sensor described by the file `views`. Broken runs are left out.
[[nodiscard]] bake::BakeOptions step_options(unsigned threads, const bake::EnsembleDescription& description);

/// The whole bake in this process. output: set to the model's path.
bake::BakeSummary bake_step(const BakeCommand& command, std::filesystem::path& output);

/// Writes the plan into `work`.
bake::BakePlan plan_step(const BakeCommand& command, const bake::WorkFolder& work);
/// Surveys one shard of the runs, which plan_step() then does not read.
void survey_step(const BakeCommand& command, const bake::WorkFolder& work, const bake::Shard& shard);
[[nodiscard]] bake::BakePlan read_plan(const bake::WorkFolder& work);
bake::ShardSummary shard_step(const bake::WorkFolder& work, const bake::BakePlan& plan, const bake::Shard& shard,
                              unsigned threads, bool verifies_finished = false);
/// output: empty for the plan's own, which it is set to.
bake::BakeSummary merge_step(const bake::WorkFolder& work, const bake::BakePlan& plan, std::filesystem::path& output,
                             unsigned threads);

/// Summary, estimate and status of a bake, as tables and as JSON.
void print_table(const bake::BakeSummary& summary, const std::filesystem::path& model);
void print_json(const bake::BakeSummary& summary, const std::filesystem::path& model);

void print_table(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);
void print_json(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);

void print_table(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);
void print_json(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);

void print_table(const bake::ShardSummary& summary);

}  // namespace lbea::tool
