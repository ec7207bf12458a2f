// Method step 2, first pass over the runs: their common mesh, the extents of their nodes, their fields and files.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/survey/common_mesh.hpp"

#include <map>

namespace lbea::bake {
struct BakePlan;
class WorkFolder;

/// One run's samples.
struct RunSurvey {
  std::vector<std::uint32_t> steps;      // stored states used, ascending
  std::vector<double> times_s;           // per step
  std::vector<std::uint32_t> fields;     // per chosen field: its index in the run's fields
  std::vector<std::uint32_t> histories;  // per history that is a channel: its place in the run
  std::vector<InputFile> files;
  std::optional<MappingReport> mapping = {};  // of a run with another mesh
  bool lacks_elements = false;                // of the common mesh, in some sample
};

struct Survey {
  std::vector<RunSurvey> runs;
  CommonMesh mesh;
  std::vector<std::uint32_t> reference_node_ids;  // of the whole reference run, also those not common
  std::array<float, 3> min{}, max{};              // box of the common nodes in all samples
  std::vector<SimulationField> fields;            // chosen, the same in every run
  MeshLosses losses;
  std::vector<std::string> warnings;  // what a user should check: a sentence each

  [[nodiscard]] std::size_t samples() const noexcept;
  /// Whether some sample lacks elements of the common mesh.
  [[nodiscard]] bool lacks_elements() const noexcept { return std::ranges::any_of(runs, &RunSurvey::lacks_elements); }
};

/// The states of a run with `states` of them that become samples, ascending.
/// Throws Error{bad_config} naming `run` when there are none or a listed one does not exist.
[[nodiscard]] std::vector<std::uint32_t> used_steps(const StepSelection& selection, std::uint32_t states,
                                                    const std::string& run);

/// Throws Error{bad_input} when the state does not fit the reader's mesh and fields or a position, except of free
/// nodes, is not finite or too large for a model.
void check_state(const SimulationReader& reader, const SimulationState& state, const std::string& run,
                 std::uint32_t step);

using Extent = std::array<float, 6>;  // min x, y, z, max x, y, z

/// What was read from one run, in the numbering of the reference run's mesh.
struct RunHistory {
  std::vector<std::uint32_t> steps;          // stored states used, ascending
  std::vector<double> times;                 // per step, in the run's unit
  std::vector<SimulationField> fields;       // all of the run
  std::vector<SimulationHistory> histories;  // the same
  std::vector<InputFile> files;
  std::string remark;                         // of the reader
  std::string misfit;                         // see misfit() in run_checks.hpp
  std::optional<MappingReport> mapping = {};  // of a run with another mesh
  std::vector<std::uint8_t> has_values;       // per field: some value in those steps is a number
  std::string erosion;                        // a warning, when much of the surface erodes
  std::vector<Presence> common;               // per element, in all its steps
  std::vector<Extent> extents;  // per node: box of its positions in those steps where it is not free; min > max when
                                // there is none
};

/// Reads each used state once, one in memory at a time. Throws Error{bad_input | bad_config} naming the run, and
/// BakeCancelled.
[[nodiscard]] RunHistory survey_run(SimulationReader& reader, const EnsembleRun& run,
                                    const EnsembleDescription& description, const SimulationReader& reference,
                                    Stage& stage);

/// Combines the histories, run by run.
class SurveyCollection {
 public:
  /// Throws Error{bad_config} when the reference run lacks a field.
  SurveyCollection(const SimulationReader& reference, const EnsembleDescription& description, const std::string& run);
  /// Throws Error{bad_input | bad_config} naming the run; the run is not added then.
  void add(RunHistory history, const std::string& run);
  /// Adds a run that is left out: no samples.
  void add_nothing() {
    survey_.runs.emplace_back();
    names_.emplace_back();
  }
  /// Throws Error{bad_input} when nothing is common.
  [[nodiscard]] Survey finish() const;

 private:
  double time_factor_;
  StepSelection steps_;
  std::vector<SolverHistory> histories_;  // that are channels
  CommonMeshBuilder mesh_;
  std::vector<Extent> extents_;  // of the reference run's nodes
  std::map<std::vector<std::uint64_t>, std::string> run_of_hashes_;
  Survey survey_;
  std::vector<std::string> names_;  // of its runs
};

/// Node of the common mesh -> node of the reference run's.
[[nodiscard]] std::vector<std::uint32_t> reference_places(const Survey& survey);

/// min x, y, z and max x, y, z of the nodes at `places` of a history's extents.
[[nodiscard]] std::array<std::array<float, 3>, 2> box_of(const std::vector<Extent>& extents,
                                                         const std::vector<std::uint32_t>& places);

/// Checks the ensemble, surveys every run that has not been surveyed, and combines the surveys into a new plan, without
/// bases. The work folder is created. Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
[[nodiscard]] BakePlan survey_runs(const WorkFolder& work, const Ensemble& ensemble,
                                   const EnsembleDescription& description, const BakeOptions& options);

/// Only the part that reads, of some runs; survey_runs() finds the surveys later.
void survey_some(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                 const std::vector<std::size_t>& runs, const BakeOptions& options);
}  // namespace lbea::bake
