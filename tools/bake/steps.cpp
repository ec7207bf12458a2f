#include "tools/bake/steps.hpp"

#include "precompute/jobs/merge_shards.hpp"
#include "tools/bake/earlier_model.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/bake/stage_progress.hpp"

#include <memory>

namespace lbea {

namespace {

/// The description with everything it names made absolute: other processes start elsewhere.
EnsembleDescription placed(const BakeCommand& command) {
  EnsembleDescription description = described(command);
  read_region_nodes(description.region);
  if (!description.views.empty()) description.views = std::filesystem::absolute(description.views);
  description.output = std::filesystem::absolute(description.output);
  return description;
}

}  // namespace

BakeOptions step_options(unsigned threads, const std::filesystem::path& views) {
  BakeOptions options;
  options.threads = threads;
  options.views = view_rendering(views);
  options.progress = [progress = std::make_shared<StageProgress>()](const BakeProgress& stage) { progress->show(stage); };
  options.cancelled = [] { return stop_requested != 0; };
  options.leaves_out_broken = true;
  return options;
}

Ensemble ensemble_of(const BakeCommand& command, const EnsembleDescription& description) {
  Ensemble ensemble = open_ensemble(description);
  if (!command.earlier.empty()) take_from_model(ensemble, description, command.earlier);
  return ensemble;
}

BakePlan plan_step(const BakeCommand& command, const WorkFolder& work) {
  const EnsembleDescription description = placed(command);
  BakeOptions options = step_options(command.threads, description.views);
  options.visible_nodes = visibility(description.region, command.threads);
  return plan_bake(work, ensemble_of(command, description), description, options);
}

void survey_step(const BakeCommand& command, const WorkFolder& work, const Shard& shard) {
  const EnsembleDescription description = placed(command);
  survey_shard(work, ensemble_of(command, description), description, shard, step_options(command.threads, {}));
}

BakePlan read_plan(const WorkFolder& work) {
  return read_plan(work, [](const std::string& source) { return open_source(source); });
}

ShardSummary shard_step(const WorkFolder& work, const BakePlan& plan, const Shard& shard, unsigned threads, bool verifies_finished) {
  BakeOptions options = step_options(threads, plan.description.views);
  options.verifies_finished = verifies_finished;
  return bake_shard(work, plan, shard, options);
}

BakeSummary merge_step(const WorkFolder& work, const BakePlan& plan, std::filesystem::path& output, unsigned threads) {
  if (output.empty()) output = plan.description.output;
  return merge_shards(work, plan, output, step_options(threads, {}));
}

}  // namespace lbea
