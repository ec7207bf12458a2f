// A bake in several processes that share a work folder: plan, shards, merge. The model has the bytes of bake_model()'s.
#pragma once

#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
/// One of `of` processes that share the work, counted from 0: it makes every of-th run.
struct Shard {
  std::uint32_t index = 0, of = 1;
};

/// Optional, before plan_bake(): surveys a share of the runs. Finished surveys are not repeated.
void survey_shard(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                  const Shard& shard, const BakeOptions& options);

/// Method steps 2 and 5: surveys the remaining runs, solves the bases, and writes the plan. Creates the work folder.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
[[nodiscard]] BakePlan plan_bake(const WorkFolder& work, const Ensemble& ensemble,
                                 const EnsembleDescription& description, const BakeOptions& options);

struct ShardSummary {
  std::size_t runs = 0;      // of this shard
  std::size_t finished = 0;  // before this call
  std::size_t renewed = 0;   // whose record existed: only grid and images were made
  std::size_t failed = 0;    // the reasons are in the work folder
};

/// Makes the samples of the shard's runs. Finished runs are not repeated; an unfinished file never has its final name,
/// even when the process is killed. Any number of processes may work at once, with any division into shards.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
ShardSummary bake_shard(const WorkFolder& work, const BakePlan& plan, const Shard& shard, const BakeOptions& options);

/// Writes the model, see write_model(). Failed runs are left out and named. Removes temporary files of killed writers;
/// the other work files stay.
/// Throws Error{bad_input} naming unfinished runs and damaged files, Error{write_failed} and BakeCancelled.
BakeSummary merge_shards(const WorkFolder& work, const BakePlan& plan, const std::filesystem::path& output,
                         const BakeOptions& options);

enum class RunProgress { waiting, running, finished, failed };

struct RunStatus {
  RunProgress progress = RunProgress::waiting;
  std::string reason;  // of a failure
};

/// One per run. A run is running while a process writes its files. When that process is killed, the run is waiting: on
/// this machine at once, on another machine after `patience_s` seconds without a write.
[[nodiscard]] std::vector<RunStatus> run_status(const WorkFolder& work, const BakePlan& plan, double patience_s = 300);
}  // namespace lbea::bake
