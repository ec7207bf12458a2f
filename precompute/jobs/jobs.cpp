#include "precompute/jobs/jobs.hpp"

#include "precompute/channels/free_channel_nodes.hpp"
#include "precompute/channels/plan_channels.hpp"
#include "precompute/model_file/write_model.hpp"
#include "precompute/parallel.hpp"
#include "precompute/samples/sample_record.hpp"
#include "precompute/work/stale_files.hpp"

#include <set>

namespace lbea::bake {
namespace {
namespace fs = std::filesystem;

void check(const Shard& shard) {
  if (shard.index >= shard.of)
    throw Error(Status::bad_config, "there is no shard " + std::to_string(shard.index) + " of " +
                                        std::to_string(shard.of) + "; they are counted from 0");
}

std::vector<std::size_t> runs_of(const Shard& shard, std::size_t runs) {
  check(shard);
  std::vector<std::size_t> share;
  for (std::size_t run = shard.index; run < runs; run += shard.of) share.push_back(run);
  return share;
}

/// Reads the finished files of a shard and removes damaged ones.
void remove_damaged(const WorkFolder& work, const BakePlan& plan, const std::vector<std::size_t>& runs,
                    const Workers& workers) {
  std::vector<WorkName> names;
  for (const std::size_t run : runs)
    for (const WorkName name : {plan.runs[run].record_name(), plan.runs[run].grid_and_images_name()})
      if (work.has(name)) names.push_back(name);
  work_in_parallel(names.size(), workers, [&](const auto& next) {
    for (std::size_t i = next(); i < names.size(); i = next()) {
      try {
        WorkReader file = work.reader(names[i]);
        std::vector<std::byte> piece(std::size_t{1} << 20);
        while (file.rest() > 0)
          file.bytes(
              std::span(piece).first(static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), file.rest()))));
        file.finish();
      } catch (const DamagedWorkFile& damaged) { work.remove(damaged); }
    }
  });
}

/// On this machine the lock of the file tells; for other machines, the time of the last write.
bool is_being_written(const fs::directory_entry& entry, const TemporaryName& name, double patience_s) {
  std::error_code error;
  if (name.host == host_name()) return !is_abandoned(entry.path()).value_or(!is_alive(name.process));
  const auto changed = entry.last_write_time(error);
  return !error && std::chrono::duration<double>(fs::file_time_type::clock::now() - changed).count() <= patience_s;
}

/// Final names of the files of a kind that are being written.
std::set<std::string> files_being_written(const WorkFolder& work, WorkKind kind, double patience_s) {
  std::set<std::string> names;
  const fs::path folder = work.file({kind, 0}).parent_path();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto name = parse_temporary(entry.path().filename().string());
    if (name && is_being_written(entry, *name, patience_s)) names.insert(name->final_name);
  }
  return names;
}
}  // namespace

void survey_shard(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                  const Shard& shard, const BakeOptions& options) {
  survey_some(work, ensemble, description, runs_of(shard, ensemble.runs.size()), options);
}

BakePlan plan_bake(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                   const BakeOptions& options) {
  BakePlan plan = survey_runs(work, ensemble, description, options);
  const Reference reference = choose_reference(plan, options);
  solve_bases(work, plan, reference, options);
  plan_channels(plan, reference);
  refuse_free_channel_nodes(work, plan);
  plan_samples(plan, options);
  write_plan(work, plan);
  return plan;
}

ShardSummary bake_shard(const WorkFolder& work, const BakePlan& plan, const Shard& shard, const BakeOptions& options) {
  const std::vector<std::size_t> share = runs_of(shard, plan.runs.size());
  if (options.verifies_finished) remove_damaged(work, plan, share, options.workers());
  ShardSummary summary;
  std::vector<std::size_t> unfinished;
  for (const std::size_t run : share) {
    const PlannedRun& planned = plan.runs[run];
    if (!planned.failure.empty()) continue;
    ++summary.runs;
    if (is_complete(work, planned)) {
      ++summary.finished;
      continue;
    }
    unfinished.push_back(run);
    if (work.has(planned.record_name())) ++summary.renewed;
  }
  summary.failed = make_samples(work, plan, unfinished, options);
  return summary;
}

BakeSummary merge_shards(const WorkFolder& work, const BakePlan& plan, const fs::path& output,
                         const BakeOptions& options) {
  try {
    BakeSummary summary = write_model(work, collect_runs(work, plan), output, options);
    work.sweep();
    return summary;
  } catch (const DamagedWorkFile& damaged) {
    work.remove(damaged);
    throw Error(
        Status::bad_input,
        std::string(damaged.what()) + "; it was removed: run plan and the shards once more, they make what is missing");
  }
}

static RunStatus status_of(const WorkFolder& work, const PlannedRun& run, bool is_running) {
  if (!run.failure.empty()) return {RunProgress::failed, run.failure};
  if (is_complete(work, run)) return {RunProgress::finished, ""};
  if (is_running) return {RunProgress::running, ""};
  const auto failure = work.failure(run.record);
  return failure ? RunStatus{RunProgress::failed, *failure} : RunStatus{};
}

std::vector<RunStatus> run_status(const WorkFolder& work, const BakePlan& plan, double patience_s) {
  const auto records = files_being_written(work, WorkKind::record, patience_s),
             grids_and_images = files_being_written(work, WorkKind::grid_and_images, patience_s);
  std::vector<RunStatus> status;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const PlannedRun& planned = plan.runs[run];
    const bool is_running = records.contains(work.file(planned.record_name()).filename().string()) ||
                            grids_and_images.contains(work.file(planned.grid_and_images_name()).filename().string());
    status.push_back(status_of(work, planned, is_running));
  }
  return status;
}
}  // namespace lbea::bake
