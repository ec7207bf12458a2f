#include "precompute/jobs/bake_shard.hpp"

#include "precompute/jobs/footprint.hpp"
#include "precompute/parallel.hpp"
#include "precompute/samples/sample_projection.hpp"
#include "precompute/stage.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

namespace lbea::bake {
namespace {

/// What all threads of a shard share.
class ShardWork {
 public:
  ShardWork(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options)
      : work_(work),
        plan_(plan),
        options_(options),
        bases_(read_bases(work, plan)),
        projection_(plan, bases_),
        places_(reference_places(plan.survey)),
        renderer_(make_renderer()) {}

  [[nodiscard]] SampleRecord buffer() const { return {plan_, bases_}; }

  /// False when the run is broken, its failure noted.
  bool bake_run(std::size_t run, SampleRecord& buffer, Stage& stage) const {
    const PlannedRun& planned = plan_.runs[run];
    try {
      make_what_is_missing(run, buffer, stage);
      work_.forget_failure(planned.record);
      return true;
    } catch (const DamagedWorkFile& damaged) {  // not the run's fault
      work_.remove(damaged);
      throw Error(Status::bad_input, std::string(damaged.what()) + "; it was removed, plan again");
    } catch (const Error& error) {
      if (!options_.leaves_out_broken || error.status == Status::write_failed) throw;
      work_.note_failure(planned.record, error.what());
      return false;
    }
  }

 private:
  [[nodiscard]] std::unique_ptr<ViewRenderer> make_renderer() const {
    if (!plan_.camera) return nullptr;
    auto renderer = options_.views ? options_.views(plan_.survey.mesh, plan_.survey.min, plan_.survey.max) : nullptr;
    if (renderer == nullptr || camera_key(renderer->camera()) != camera_key(*plan_.camera))
      throw Error(Status::bad_config, "the sensor description changed since the bake was planned; plan again");
    return renderer;
  }

  void make_what_is_missing(std::size_t run, SampleRecord& buffer, Stage& stage) const {
    const PlannedRun& planned = plan_.runs[run];
    if (!work_.has(planned.record_name())) make_record(run, stage);
    if (work_.has(planned.footprint_name())) return;
    try {
      make_footprint(work_, plan_, run, buffer, renderer_.get());
    } catch (const DamagedWorkFile& damaged) {  // an earlier process's record
      work_.remove(damaged);
      make_record(run, stage);
      make_footprint(work_, plan_, run, buffer, renderer_.get());
    }
  }

  void make_record(std::size_t run, Stage& stage) const {
    const auto reader = plan_.ensemble.runs[run].open();
    check_unchanged(run, reader->files());
    const auto box = box_of(read_survey(work_, plan_.runs[run]).extents, places_);
    WorkWriter record = work_.writer(plan_.runs[run].record_name());
    projection_.project_run(run, *reader, box, record, stage);
    check_unchanged(run, reader->files());
    record.commit();
  }

  void check_unchanged(std::size_t run, const std::vector<std::filesystem::path>& files) const {
    if (last_changes(files) != plan_.runs[run].modified)
      throw Error(Status::bad_input, "the files of run " + plan_.ensemble.runs[run].name +
                                         " changed since the bake was planned; plan again");
  }

  const WorkFolder& work_;
  const BakePlan& plan_;
  const BakeOptions& options_;
  std::vector<ReferenceBasis> bases_;
  SampleProjection projection_;
  std::vector<std::uint32_t> places_;  // see reference_places()
  std::unique_ptr<ViewRenderer> renderer_;
};

/// Reads what is finished, and removes what is not as it was written.
void remove_damaged(const WorkFolder& work, const BakePlan& plan, const Shard& shard, unsigned threads) {
  std::vector<WorkName> names;
  for (std::size_t run = 0; run < plan.runs.size(); ++run)
    for (const WorkName name : {plan.runs[run].record_name(), plan.runs[run].footprint_name()})
      if (shard.has(run) && work.has(name)) names.push_back(name);
  work_in_parallel(names.size(), threads, [&](const auto& next) {
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

}  // namespace

ShardSummary bake_shard(const WorkFolder& work, const BakePlan& plan, const Shard& shard, const BakeOptions& options) {
  check(shard);
  if (options.verifies_finished) remove_damaged(work, plan, shard, options.threads);
  ShardSummary summary;
  std::vector<std::size_t> to_do;
  std::uint64_t samples = 0;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    if (!shard.has(run) || !plan.runs[run].failure.empty()) continue;
    ++summary.runs;
    if (work.has(plan.runs[run].record_name()) && work.has(plan.runs[run].footprint_name())) {
      ++summary.finished;
      continue;
    }
    to_do.push_back(run);
    if (work.has(plan.runs[run].record_name())) ++summary.renewed;
    samples += plan.survey.runs[run].steps.size();
  }
  if (to_do.empty()) return summary;
  const ShardWork shared(work, plan, options);
  Stage stage(options, "samples", samples);
  std::atomic<std::size_t> failed{0};
  work_in_parallel(to_do.size(), options.threads, [&](const auto& next) {
    SampleRecord buffer = shared.buffer();
    for (std::size_t i = next(); i < to_do.size(); i = next())
      if (!shared.bake_run(to_do[i], buffer, stage)) ++failed;
  });
  summary.failed = failed;
  return summary;
}

}  // namespace lbea::bake
