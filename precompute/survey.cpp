#include "precompute/survey.hpp"

#include "precompute/file_hash.hpp"
#include "precompute/parallel.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <unordered_map>

namespace lbea {

namespace {

using Extent = std::array<float, 6>;  // min x, y, z, max x, y, z of one node
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr Extent nowhere{infinity, infinity, infinity, -infinity, -infinity, -infinity};

void widen(Extent& extent, const Extent& by) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent[axis] = std::min(extent[axis], by[axis]);
    extent[axis + 3] = std::max(extent[axis + 3], by[axis + 3]);
  }
}

/// What one run does in its used states.
struct RunHistory {
  std::vector<std::uint8_t> alive;  // elements, throughout
  std::vector<Extent> extents;      // nodes
};

RunHistory read_history(SimulationReader& reader, const std::vector<std::uint32_t>& steps,
                        const std::string& run, Stage& stage) {
  const SimulationMesh& mesh = reader.mesh();
  RunHistory history{std::vector<std::uint8_t>(mesh.elements.size(), 1),
                     std::vector<Extent>(mesh.nodes(), nowhere)};
  SimulationState state;
  for (const std::uint32_t step : steps) {
    stage.check();
    reader.read(step, state);
    check_state(reader, state, run, step);
    for (std::size_t e = 0; e < state.alive.size(); ++e)
      history.alive[e] = history.alive[e] && state.alive[e];
    for (std::size_t i = 0; i < mesh.nodes(); ++i) {
      const float* p = &state.positions[3 * i];
      widen(history.extents[i], {p[0], p[1], p[2], p[0], p[1], p[2]});
    }
  }
  return history;
}

std::vector<double> step_times(const SimulationReader& reader, const std::vector<std::uint32_t>& steps,
                               double factor, const std::string& run) {
  std::vector<double> times;
  for (const std::uint32_t step : steps) {
    times.push_back(reader.time_s(step) * factor);
    if (!std::isfinite(times.back()))
      throw Error(Status::bad_input,
                  "run " + run + ": the time of state " + std::to_string(step) + " is not finite");
  }
  return times;
}

std::vector<InputFile> hashed_files(const SimulationReader& reader) {
  std::vector<InputFile> files;
  for (const std::filesystem::path& path : reader.files()) {
    const auto [size, hash] = hash_file(path);
    files.push_back({path.filename().string(), size, hash});
  }
  return files;
}

std::string listed(const std::vector<SimulationField>& fields) {
  std::string names;
  for (const SimulationField& field : fields) names += (names.empty() ? "" : ", ") + field.name;
  return names.empty() ? "none" : names;
}

std::vector<std::uint32_t> find_fields(const std::vector<SimulationField>& chosen,
                                       const std::vector<SimulationField>& present, const std::string& run) {
  std::vector<std::uint32_t> places;
  for (const SimulationField& field : chosen) {
    const auto found = std::ranges::find(present, field.name, &SimulationField::name);
    if (found == present.end())
      throw Error(Status::bad_config, "run " + run + " has no field '" + field.name + "'; it has: " +
                                          listed(present) + "; choose the fields that all runs have");
    places.push_back(static_cast<std::uint32_t>(found - present.begin()));
  }
  return places;
}

std::vector<SimulationField> chosen_fields(const std::vector<std::string>& names,
                                           const std::vector<SimulationField>& present,
                                           const std::string& run) {
  if (std::ranges::find(names, "all") != names.end()) return present;
  std::vector<SimulationField> chosen;
  for (const std::string& name : names) chosen.push_back({name, ""});
  for (std::size_t i = 0; const std::uint32_t place : find_fields(chosen, present, run))
    chosen[i++] = present[place];
  return chosen;
}

/// Collects the runs' histories in the reference run's numbering; the order of the runs does not matter.
class Collection {
 public:
  Collection(const SimulationReader& reference, const std::string& run)
      : mesh_(reference.mesh(), run), extents_(reference.mesh().nodes(), nowhere) {
    for (std::size_t i = 0; i < extents_.size(); ++i) place_.emplace(reference.mesh().node_ids[i], i);
  }

  void add(const SimulationMesh& mesh, const RunHistory& history, const std::string& run) {
    const std::lock_guard lock(mutex_);
    mesh_.keep_common(mesh, history.alive, run);
    for (std::size_t i = 0; i < mesh.nodes(); ++i) {
      const auto found = place_.find(mesh.node_ids[i]);
      if (found != place_.end()) widen(extents_[found->second], history.extents[i]);
    }
  }

  void finish(Survey& survey) const {
    survey.mesh = mesh_.finish();
    survey.reference_node_ids = mesh_.reference().node_ids;
    Extent all = nowhere;
    for (const std::uint32_t id : survey.mesh.node_ids) widen(all, extents_[place_.at(id)]);
    std::copy_n(all.begin(), 3, survey.min.begin());
    std::copy_n(all.begin() + 3, 3, survey.max.begin());
  }

 private:
  std::mutex mutex_;
  CommonMeshBuilder mesh_;
  std::unordered_map<std::uint32_t, std::size_t> place_;  // node id -> index in the reference
  std::vector<Extent> extents_;
};

RunSurvey survey_run(const EnsembleRun& run, const EnsembleDescription& description,
                     const std::vector<SimulationField>& fields, Collection& collection, Stage& stage) {
  const auto reader = run.open();
  RunSurvey survey;
  survey.steps = used_steps(description.steps, reader->states(), run.name);
  survey.times_s = step_times(*reader, survey.steps, description.time_factor, run.name);
  survey.fields = find_fields(fields, reader->fields(), run.name);
  collection.add(reader->mesh(), read_history(*reader, survey.steps, run.name, stage), run.name);
  survey.files = hashed_files(*reader);
  stage.step();
  return survey;
}

}  // namespace

void check_state(const SimulationReader& reader, const SimulationState& state, const std::string& run,
                 std::uint32_t step) {
  const SimulationMesh& mesh = reader.mesh();
  const std::string where = "run " + run + ", state " + std::to_string(step);
  const bool fits =
      state.positions.size() == 3 * mesh.nodes() && state.alive.size() == mesh.elements.size() &&
      state.fields.size() == reader.fields().size() &&
      std::ranges::all_of(state.fields,
                          [&](const auto& field) { return field.size() == mesh.elements.size(); });
  if (!fits)
    throw Error(Status::bad_input,
                where + ": the state does not fit the mesh; is the file still being written?");
  const auto bad = std::ranges::find_if(state.positions, [](float x) { return !std::isfinite(x); });
  if (bad == state.positions.end()) return;
  const auto node = static_cast<std::size_t>(bad - state.positions.begin()) / 3;
  throw Error(Status::bad_input, where + ": the position of node " + std::to_string(mesh.node_ids[node]) +
                                     " is not finite; leave this state out");
}

std::size_t Survey::samples() const noexcept {
  return std::accumulate(runs.begin(), runs.end(), std::size_t{0},
                         [](std::size_t sum, const RunSurvey& run) { return sum + run.steps.size(); });
}

std::vector<std::uint32_t> used_steps(const StepSelection& selection, std::uint32_t states,
                                      const std::string& run) {
  std::vector<std::uint32_t> steps = selection.list;
  std::ranges::sort(steps);
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  if (!steps.empty() && steps.back() >= states)
    throw Error(Status::bad_config, "run " + run + " has no state " + std::to_string(steps.back()) +
                                        ", only " + std::to_string(states) + "; correct the list of steps");
  if (selection.stride == 0)
    throw Error(Status::bad_config, "the stride of the steps is 0; it must be 1 or more");
  if (selection.list.empty())
    for (std::uint64_t step = selection.first; step < states && step <= selection.last;
         step += selection.stride)
      steps.push_back(static_cast<std::uint32_t>(step));
  if (steps.empty())
    throw Error(Status::bad_config, "no state of run " + run + " is used: it has " + std::to_string(states) +
                                        "; correct the steps or leave the run out");
  return steps;
}

Survey survey_runs(const Ensemble& ensemble, const EnsembleDescription& description, unsigned threads,
                   Stage& stage) {
  const EnsembleRun& reference_run = ensemble.runs.at(ensemble.reference_run);
  const auto reference = reference_run.open();
  Collection collection(*reference, reference_run.name);
  Survey survey;
  survey.fields = chosen_fields(description.fields, reference->fields(), reference_run.name);
  survey.runs.resize(ensemble.runs.size());
  work_in_parallel(ensemble.runs.size(), threads, [&](const auto& next) {
    for (std::size_t run = next(); run < ensemble.runs.size(); run = next())
      survey.runs[run] = survey_run(ensemble.runs[run], description, survey.fields, collection, stage);
  });
  collection.finish(survey);
  return survey;
}

}  // namespace lbea
