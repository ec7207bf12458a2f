// What is to be baked, as shards and merge read it: description, survey, bases, and the files of every run.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/channels/channel_series.hpp"
#include "precompute/survey/survey.hpp"
#include "precompute/work/work_folder.hpp"
#include "runtime/src/depth/depth_images.hpp"

namespace lbea::bake {
/// The work files of one run. A key is a hash of everything that the file's content depends on: the next plan finds
/// what is finished and has not changed.
struct PlannedRun {
  std::vector<std::int64_t> modified;  // when its files were last changed, the file system's clock
  std::uint64_t survey = 0, record = 0, grid_and_images = 0;
  std::string failure;  // why it could not be surveyed and is left out; empty: it was surveyed

  [[nodiscard]] WorkName survey_name() const noexcept { return {WorkKind::survey, survey}; }
  [[nodiscard]] WorkName record_name() const noexcept { return {WorkKind::record, record}; }
  [[nodiscard]] WorkName grid_and_images_name() const noexcept { return {WorkKind::grid_and_images, grid_and_images}; }
};

/// Whether the run was baked.
[[nodiscard]] inline bool is_complete(const WorkFolder& work, const PlannedRun& run) {
  return work.has(run.record_name()) && work.has(run.grid_and_images_name());
}

struct BakePlan {
  EnsembleDescription description;
  Ensemble ensemble;
  Survey survey;                                  // runs that are left out have no steps
  std::vector<PlannedRun> runs;                   // as in the ensemble
  std::vector<std::uint64_t> bases;               // keys, per reference
  std::vector<PlannedChannel> channels;           // as in the description
  std::optional<DepthCamera> camera;              // of the depth images, when there are any
  std::vector<DepthCamera> more_cameras;          // of further rigs' images, which the merge renders
  double reading_seconds = 0, bases_seconds = 0;  // duration of these steps; not kept in the file
};

using RunOpener = std::function<std::unique_ptr<SimulationReader>(const std::string& source)>;

void write_plan(const WorkFolder& work, const BakePlan& plan);
/// Throws Error{bad_input} when there is none.
[[nodiscard]] BakePlan read_plan(const WorkFolder& work, const RunOpener& opener);

/// The plan's bases, in the order of its references. Throws Error{bad_input}.
[[nodiscard]] std::vector<ReferenceBasis> read_bases(const WorkFolder& work, const BakePlan& plan);
void write_basis(const WorkFolder& work, std::uint64_t key, const ReferenceBasis& basis);

[[nodiscard]] RunHistory read_survey(const WorkFolder& work, const PlannedRun& run);
void write_survey(const WorkFolder& work, const PlannedRun& run, const RunHistory& history);

/// The part of a survey's key that all runs share: reference mesh and selection of steps.
[[nodiscard]] std::uint64_t survey_key(const SimulationMesh& reference, const EnsembleDescription& description);
/// Of one run: its name, and name, size and last change of its files, whose content is not read.
[[nodiscard]] std::uint64_t survey_key(std::uint64_t common_key, const std::string& name,
                                       const std::vector<std::filesystem::path>& files,
                                       const std::vector<std::int64_t>& modified);
[[nodiscard]] std::uint64_t basis_key(const ObservedRegion& region, const CommonMesh& mesh,
                                      const std::vector<float>& positions, std::uint32_t modes, double time_s);
[[nodiscard]] std::uint64_t camera_key(const DepthCamera& camera);
/// On the file system's clock. Throws Error{bad_input} naming a missing file.
[[nodiscard]] std::vector<std::int64_t> last_changes(const std::vector<std::filesystem::path>& files);
/// Sets the keys of the runs' records, grids and images.
void set_keys(BakePlan& plan);

/// The plan without some of its runs. is_kept: per run.
[[nodiscard]] BakePlan without_runs(const BakePlan& plan, const std::vector<bool>& is_kept);
}  // namespace lbea::bake
