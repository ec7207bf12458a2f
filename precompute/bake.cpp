#include "precompute/bake.hpp"

#include "precompute/jobs/bake_shard.hpp"
#include "precompute/jobs/estimate.hpp"
#include "precompute/jobs/merge_shards.hpp"
#include "precompute/jobs/plan_bake.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "runtime/src/match/stopwatch.hpp"

namespace lbea::bake {

BakeSummary bake_model(const Ensemble& ensemble, const EnsembleDescription& description,
                       const std::filesystem::path& output, const BakeOptions& options) {
  check_replaceable(output);
  const PassingWorkFolder passing(output);
  const BakePlan plan = plan_bake(passing.folder(), ensemble, description, options);
  check_space(passing.folder(), plan);
  Stopwatch watch;
  bake_shard(passing.folder(), plan, {0, 1}, options);
  const double samples_seconds = watch.lap_s();
  BakeSummary summary = merge_shards(passing.folder(), plan, output, options);
  summary.seconds.samples = samples_seconds;
  return summary;
}

}  // namespace lbea::bake
