// What is to be baked, as its shards and the merge read it: reference, region, bases, and the work, run by run.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"
#include "precompute/jobs/work_folder.hpp"
#include "precompute/survey/survey.hpp"
#include "runtime/src/depth/depth_images.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lbea::bake {

/// One run's place in the work folder. A key is a hash of all that the file's content depends on: what is finished
/// stays finished in the next plan, as far as it is the same work.
struct PlannedRun {
  std::vector<std::int64_t> modified;  // when its files were last changed, the file system's clock
  std::uint64_t survey = 0, record = 0, footprint = 0;
  std::string failure;  // why it could not be surveyed and is left out; empty: it is not

  [[nodiscard]] WorkName survey_name() const noexcept { return {WorkKind::survey, survey}; }
  [[nodiscard]] WorkName record_name() const noexcept { return {WorkKind::record, record}; }
  [[nodiscard]] WorkName footprint_name() const noexcept { return {WorkKind::footprint, footprint}; }
};

struct BakePlan {
  EnsembleDescription description;
  Ensemble ensemble;
  Survey survey;                                  // runs that are left out have no steps
  std::vector<PlannedRun> runs;                   // as in the ensemble
  std::vector<std::uint64_t> bases;               // keys, per reference
  std::optional<DepthCamera> camera;              // of the depth images, when there are any
  double reading_seconds = 0, bases_seconds = 0;  // what planning took; not kept in the file
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

/// Reference mesh and selection of steps make a survey what it is, beside the run's files.
[[nodiscard]] std::uint64_t survey_key(const SimulationMesh& reference, const EnsembleDescription& description);
/// Of one run: its name, and name, size and last change of its files, whose bytes are not looked at.
[[nodiscard]] std::uint64_t survey_key(std::uint64_t common_key, const std::string& name,
                                       const std::vector<std::filesystem::path>& files,
                                       const std::vector<std::int64_t>& modified);
[[nodiscard]] std::uint64_t basis_key(const ObservedRegion& region, const CommonMesh& mesh,
                                      const std::vector<float>& positions, std::uint32_t modes, double time_s);
[[nodiscard]] std::uint64_t camera_key(const DepthCamera& camera);
/// On the file system's clock. Throws Error{bad_input} naming a file that is not there.
[[nodiscard]] std::vector<std::int64_t> last_changes(const std::vector<std::filesystem::path>& files);
/// Fills in the runs' keys of records and footprints.
void set_keys(BakePlan& plan);

}  // namespace lbea::bake
