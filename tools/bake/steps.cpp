#include "tools/bake/steps.hpp"

#include "precompute/jobs/jobs.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"

namespace lbea::tool {
namespace {

bake::EnsembleDescription completed(const BakeCommand& command) {
  bake::EnsembleDescription description = described(command);
  complete_region(description.region, rigs_of(description));
  return description;
}

/// The same with absolute paths: the processes of later steps may have other working folders.
bake::EnsembleDescription placed(const BakeCommand& command) {
  bake::EnsembleDescription description = completed(command);
  if (!description.depth_sensor.empty()) description.depth_sensor = std::filesystem::absolute(description.depth_sensor);
  for (std::filesystem::path& sensor : description.more_depth_sensors) sensor = std::filesystem::absolute(sensor);
  description.output = std::filesystem::absolute(description.output);
  return description;
}

/// The runs of the description; those that the model of --from holds are taken from it.
bake::Ensemble ensemble_of(const BakeCommand& command, const bake::EnsembleDescription& description) {
  bake::Ensemble ensemble = open_ensemble(description);
  if (!command.earlier.empty()) take_from_model(ensemble, description, command.earlier);
  return ensemble;
}

}  // namespace

bake::BakeOptions step_options(unsigned threads, const bake::EnsembleDescription& description) {
  bake::BakeOptions options;
  options.threads = threads;
  add_depth_renderers(options, description);
  options.progress = [progress = std::make_shared<StageProgress>()](const bake::BakeProgress& stage) {
    progress->show(stage.stage, stage.done, stage.total);
  };
  options.cancelled = [] { return stop_requested != 0; };
  options.leaves_out_broken = true;
  return options;
}

bake::BakeSummary bake_step(const BakeCommand& command, std::filesystem::path& output) {
  const bake::EnsembleDescription description = completed(command);
  bake::BakeOptions options = step_options(command.threads, description);
  options.visible_nodes = visibility(description.region);
  options.leaves_out_broken = command.leave_out_broken;
  output = description.output;
  return bake::bake_model(ensemble_of(command, description), description, output, options);
}

bake::BakePlan plan_step(const BakeCommand& command, const bake::WorkFolder& work) {
  const bake::EnsembleDescription description = placed(command);
  bake::BakeOptions options = step_options(command.threads, description);
  options.visible_nodes = visibility(description.region);
  return bake::plan_bake(work, ensemble_of(command, description), description, options);
}

void survey_step(const BakeCommand& command, const bake::WorkFolder& work, const bake::Shard& shard) {
  const bake::EnsembleDescription description = placed(command);
  bake::survey_shard(work, ensemble_of(command, description), description, shard, step_options(command.threads, {}));
}

bake::BakePlan read_plan(const bake::WorkFolder& work) { return read_plan(work, open_source); }

bake::ShardSummary shard_step(const bake::WorkFolder& work, const bake::BakePlan& plan, const bake::Shard& shard,
                              unsigned threads, bool verifies_finished) {
  bake::BakeOptions options = step_options(threads, plan.description);
  options.verifies_finished = verifies_finished;
  return bake::bake_shard(work, plan, shard, options);
}

bake::BakeSummary merge_step(const bake::WorkFolder& work, const bake::BakePlan& plan, std::filesystem::path& output,
                             unsigned threads) {
  if (output.empty()) output = plan.description.output;
  return bake::merge_shards(work, plan, output, step_options(threads, plan.description));
}

}  // namespace lbea::tool
