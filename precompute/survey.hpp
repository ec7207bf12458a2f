// First pass over the runs: what they have in common, where they are, what they consist of.
#pragma once

#include "precompute/common_mesh.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"
#include "precompute/stage.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lbea {

struct InputFile {
  std::string name;  // without folder
  std::uint64_t size = 0;
  std::uint64_t hash = 0;  // XXH3-64
};

/// One run's share of the samples.
struct RunSurvey {
  std::vector<std::uint32_t> steps;   // stored states used, ascending
  std::vector<double> times_s;        // per step
  std::vector<std::uint32_t> fields;  // per chosen field: its place in the run's fields
  std::vector<InputFile> files;
};

struct Survey {
  std::vector<RunSurvey> runs;
  CommonMesh mesh;
  std::vector<std::uint32_t> reference_node_ids;  // of the whole reference run, also those not common
  std::array<float, 3> min{}, max{};              // box of the common nodes in all samples
  std::vector<SimulationField> fields;            // chosen, the same in every run

  [[nodiscard]] std::size_t samples() const noexcept;
};

/// The states of a run with `states` of them that become samples, ascending.
/// Throws Error{bad_config} naming `run` when there are none or a listed one does not exist.
[[nodiscard]] std::vector<std::uint32_t> used_steps(const StepSelection& selection, std::uint32_t states,
                                                    const std::string& run);

/// Throws Error{bad_input} when the state does not fit the reader's mesh and fields or a position is not finite.
void check_state(const SimulationReader& reader, const SimulationState& state, const std::string& run,
                 std::uint32_t step);

/// One run at a time per thread, each state once; a step of the stage is a run.
/// Throws Error{bad_input | bad_config} naming the run.
[[nodiscard]] Survey survey_runs(const Ensemble& ensemble, const EnsembleDescription& description,
                                 unsigned threads, Stage& stage);

}  // namespace lbea
