#include "precompute/survey/survey.hpp"

#include "precompute/channels/channel_history.hpp"
#include "precompute/survey/run_checks.hpp"
#include "runtime/src/model/checksum.hpp"
#include "runtime/src/model/model_format.hpp"

#include <fstream>
#include <numeric>
#include <unordered_map>

namespace lbea::bake {
namespace {
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr Extent empty_extent{infinity, infinity, infinity, -infinity, -infinity, -infinity};

void widen(Extent& extent, const Extent& by) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent[axis] = std::min(extent[axis], by[axis]);
    extent[axis + 3] = std::max(extent[axis + 3], by[axis + 3]);
  }
}

/// The extents of the run's nodes and the presence of its elements, in its own numbering.
struct Movement {
  PresenceInStates presence;
  std::vector<Extent> extents;
  std::vector<std::uint8_t> has_values;  // per field: some value is a number
  std::string erosion;                   // a warning
};

/// alive: of all elements in a used state.
std::string much_eroded(const SimulationMesh& mesh, std::span<const std::uint8_t> alive, std::uint32_t step) {
  const auto outer = alive.first(alive.size() - mesh.touching);
  const auto eroded = static_cast<std::size_t>(std::ranges::count(outer, 0));
  if (2 * eroded <= outer.size()) return {};
  return std::to_string(eroded) + " of its " + std::to_string(outer.size()) + " elements are eroded in state " +
         std::to_string(step) + "; the shape is continued from the others, leave out late states or the run";
}

void refuse_without_surface(std::span<const std::uint8_t> surface, std::uint32_t step, const std::string& run) {
  if (!surface.empty() && std::ranges::find(surface, 1) == surface.end())
    throw Error(Status::bad_input, "run " + run + ", state " + std::to_string(step) +
                                       ": all elements are eroded; leave out this state and later ones");
}

bool has_number(const std::vector<float>& values) {
  return std::ranges::any_of(values, [](float value) { return std::isfinite(value); });
}

Movement read_movement(SimulationReader& reader, const std::vector<std::uint32_t>& steps, const std::string& run,
                       const std::string& unit, Stage& stage) {
  const SimulationMesh& mesh = reader.mesh();
  Movement movement{PresenceInStates(mesh.elements.size()),
                    std::vector<Extent>(mesh.nodes(), empty_extent),
                    std::vector<std::uint8_t>(reader.fields().size(), 0),
                    {}};
  NodeDistances distances;
  SimulationState state;
  for (const std::uint32_t step : steps) {
    stage.check();
    reader.read(step, state);
    check_state(reader, state, run, step);
    const std::vector<std::uint8_t> surface = exposed_elements(mesh, state.alive);
    refuse_without_surface(surface, step, run);
    movement.presence.add(surface);
    if (movement.erosion.empty()) movement.erosion = much_eroded(mesh, state.alive, step);
    const std::vector<std::uint8_t> is_free = free_nodes(mesh, state.alive);
    for (std::size_t i = 0; i < mesh.nodes(); ++i) {
      if (is_free[i] != 0) continue;
      const float* p = &state.positions[3 * i];
      widen(movement.extents[i], {p[0], p[1], p[2], p[0], p[1], p[2]});
    }
    for (std::size_t f = 0; f < state.fields.size(); ++f)
      movement.has_values[f] = movement.has_values[f] || has_number(state.fields[f]);
    distances.add(step, state.positions, is_free);
  }
  distances.refuse_far(reader, run, unit);
  return movement;
}

std::vector<Extent> in_numbering_of(const SimulationMesh& reference, const SimulationMesh& mesh,
                                    const std::vector<Extent>& extents) {
  if (mesh.node_ids == reference.node_ids) return extents;
  std::unordered_map<std::uint32_t, std::size_t> place;  // node id -> index in the run
  for (std::size_t i = 0; i < mesh.nodes(); ++i) place.emplace(mesh.node_ids[i], i);
  std::vector<Extent> result(reference.nodes(), empty_extent);
  for (std::size_t i = 0; i < result.size(); ++i)
    if (const auto found = place.find(reference.node_ids[i]); found != place.end()) result[i] = extents[found->second];
  return result;
}

/// Of a node that does not move, that the run lacks or that is always free.
bool is_at_one_place(const Extent& extent) {
  return extent[0] >= extent[3] && extent[1] >= extent[4] && extent[2] >= extent[5];
}

std::vector<double> step_times(std::vector<double> times, const std::vector<std::uint32_t>& steps, double factor,
                               const std::string& run) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    times[i] *= factor;
    if (!format::is_measured(times[i]))
      throw Error(Status::bad_input, "run " + run + ": the time of state " + std::to_string(steps[i]) +
                                         " is not finite or beyond 1e12 s; correct it or leave the state out");
  }
  return times;
}

/// Reads the file in pieces.
InputFile hash_file(const std::filesystem::path& path) {
  constexpr std::size_t piece = std::size_t{1} << 20;
  RunningChecksum checksum;
  std::ifstream file(path, std::ios::binary);
  std::vector<char> buffer(piece);
  InputFile result{path.filename().string()};
  while (file) {
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    const auto got = static_cast<std::size_t>(file.gcount());
    checksum.add(std::as_bytes(std::span(buffer).first(got)));
    result.size += got;
  }
  if (!file.eof()) throw Error(Status::bad_input, "cannot read " + path.string() + "; check the file and its rights");
  result.hash = checksum.value();
  return result;
}

std::vector<InputFile> hashed_files(const SimulationReader& reader) {
  std::vector<InputFile> files;
  for (const std::filesystem::path& path : all_files(reader)) files.push_back(hash_file(path));
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
      throw Error(Status::bad_config,
                  "run " + run + " has no field '" + field.name + "'; it has: " + listed(present) +
                      "; choose fields that all runs have, or none with fields = [] or --fields none");
    places.push_back(static_cast<std::uint32_t>(found - present.begin()));
  }
  return places;
}

std::vector<SimulationField> chosen_fields(const std::vector<std::string>& names,
                                           const std::vector<SimulationField>& present, const std::string& run) {
  if (std::ranges::find(names, "all") != names.end()) return present;
  std::vector<SimulationField> chosen;
  for (const std::string& name : names) chosen.push_back({name, ""});
  for (std::size_t i = 0; const std::uint32_t place : find_fields(chosen, present, run)) chosen[i++] = present[place];
  return chosen;
}
}  // namespace

void check_state(const SimulationReader& reader, const SimulationState& state, const std::string& run,
                 std::uint32_t step) {
  const SimulationMesh& mesh = reader.mesh();
  const std::string where = "run " + run + ", state " + std::to_string(step);
  const bool fits =
      state.positions.size() == 3 * mesh.nodes() && state.alive.size() == mesh.elements.size() &&
      state.fields.size() == reader.fields().size() &&
      std::ranges::all_of(state.fields, [&](const auto& field) { return field.size() == mesh.elements.size(); });
  if (!fits)
    throw Error(Status::bad_input, where + ": the state does not fit the mesh; is the file still being written?");
  // A model with larger positions would be written, but could not be opened.
  if (std::ranges::all_of(state.positions, format::is_measured<float>)) return;
  const std::vector<std::uint8_t> is_free = free_nodes(mesh, state.alive);
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    if (is_free[i / 3] == 0 && !format::is_measured(state.positions[i]))
      throw Error(Status::bad_input, where + ": the position of node " + std::to_string(mesh.node_ids[i / 3]) +
                                         " is not finite or beyond 1e12; leave this state out");
}

std::size_t Survey::samples() const noexcept {
  return std::accumulate(runs.begin(), runs.end(), std::size_t{0},
                         [](std::size_t sum, const RunSurvey& run) { return sum + run.steps.size(); });
}

std::vector<std::uint32_t> used_steps(const StepSelection& selection, std::uint32_t states, const std::string& run) {
  std::vector<std::uint32_t> steps = selection.list;
  std::ranges::sort(steps);
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  if (!steps.empty() && steps.back() >= states)
    throw Error(Status::bad_config, "run " + run + " has no state " + std::to_string(steps.back()) + ", only " +
                                        std::to_string(states) + "; correct the list of steps");
  if (selection.stride == 0) throw Error(Status::bad_config, "the stride of the steps is 0; it must be 1 or more");
  if (selection.list.empty())
    for (std::uint64_t step = selection.first; step < states && step <= selection.last; step += selection.stride)
      steps.push_back(static_cast<std::uint32_t>(step));
  if (steps.empty())
    throw Error(Status::bad_config, "no state of run " + run + " is used: it has " + std::to_string(states) +
                                        "; correct the steps or leave the run out");
  return steps;
}

/// All of the run. Throws the Error of find_histories(), with what the reader says of its files.
std::vector<SimulationHistory> histories_with(const std::vector<SolverHistory>& chosen, SimulationReader& reader,
                                              const std::string& run) {
  std::vector<SimulationHistory> present = reader.histories();
  try {
    (void)find_histories(chosen, present, run);
  } catch (const Error& error) {
    const std::string remark = reader.remark();
    throw Error(error.status, error.what() + (remark.empty() ? "" : " (" + remark + ")"));
  }
  return present;
}

RunHistory survey_run(SimulationReader& reader, const EnsembleRun& run, const EnsembleDescription& description,
                      const SimulationReader& reference, Stage& stage) {
  RunHistory history;
  if (reader.states() == 0)
    throw Error(Status::bad_input, reader.files().front().string() +
                                       " holds only the mesh; the file with the states is missing beside it (" +
                                       reader.files().front().filename().string() + "01)");
  history.steps = used_steps(description.steps, reader.states(), run.name);
  for (const std::uint32_t step : history.steps) history.times.push_back(reader.time_s(step));
  (void)step_times(history.times, history.steps, description.time_factor, run.name);
  history.fields = reader.fields();
  (void)find_fields(chosen_fields(description.fields, reference.fields(), run.name), history.fields, run.name);
  if (const auto chosen = chosen_histories(description); !chosen.empty())
    history.histories = histories_with(chosen, reader, run.name);
  const Movement movement = read_movement(reader, history.steps, run.name, description.length_unit, stage);
  history.common = common_elements(reference.mesh(), reader.mesh(), movement.presence.presence(), run.name);
  history.extents = in_numbering_of(reference.mesh(), reader.mesh(), movement.extents);
  history.files = run.files.empty() ? hashed_files(reader) : run.files;
  history.remark = reader.remark();
  history.mapping = reader.mapping();
  history.misfit = misfit(reference.mesh(), reader.mesh(), run.name, description.length_unit);
  history.has_values = movement.has_values;
  history.erosion = movement.erosion;
  return history;
}

SurveyCollection::SurveyCollection(const SimulationReader& reference, const EnsembleDescription& description,
                                   const std::string& run)
    : time_factor_(description.time_factor),
      steps_(description.steps),
      histories_(chosen_histories(description)),
      mesh_(reference.mesh(), run),
      extents_(reference.mesh().nodes(), empty_extent) {
  survey_.fields = chosen_fields(description.fields, reference.fields(), run);
  survey_.reference_node_ids = reference.mesh().node_ids;
}

void SurveyCollection::add(RunHistory history, const std::string& run) {
  RunSurvey survey;
  survey.fields = find_fields(survey_.fields, history.fields, run);
  survey.histories = find_histories(histories_, history.histories, run);
  survey.times_s = step_times(std::move(history.times), history.steps, time_factor_, run);
  survey.steps = std::move(history.steps);
  survey.files = std::move(history.files);
  survey.mapping = history.mapping;
  if (history.extents.size() != extents_.size() || history.common.size() != mesh_.reference().elements.size())
    throw Error(Status::bad_input, "run " + run + " was surveyed with another reference; delete the survey");
  mesh_.keep(history.common, run);
  for (std::size_t i = 0; i < extents_.size(); ++i) widen(extents_[i], history.extents[i]);
  for (const std::string& text : {history.remark, history.misfit, history.erosion})
    if (!text.empty()) survey_.warnings.push_back("run " + run + ": " + text);
  for (const std::uint32_t field : survey.fields)
    if (history.has_values.at(field) == 0)
      survey_.warnings.push_back("run " + run + ": field '" + history.fields[field].name +
                                 "' has no number in any element of any used state; is it exported?");
  if (survey.steps.size() > 1 && std::ranges::all_of(history.extents, is_at_one_place))
    survey_.warnings.push_back("run " + run +
                               ": no node moves in the used states; is the motion in another array of its files?");
  if (auto warning = irregular_times(survey, run)) survey_.warnings.push_back(std::move(*warning));
  std::vector<std::uint64_t> hashes;
  for (const InputFile& file : survey.files) hashes.push_back(file.hash);
  const auto [other, is_new] = run_of_hashes_.emplace(std::move(hashes), run);
  if (!is_new && !survey.files.empty())
    survey_.warnings.push_back(
        "runs " + other->second + " and " + run +
        " have the same content: they share the probability of one simulation, and limits of verdicts and "
        "bounds of errors are learned as if each were explained by another run; remove the copy");
  survey_.runs.push_back(std::move(survey));
  names_.push_back(run);
}

Survey SurveyCollection::finish() const {
  Survey survey = survey_;
  survey.mesh = mesh_.finish();
  survey.losses = mesh_.losses();
  const std::vector<std::uint8_t> lack = mesh_.lack_elements();
  for (std::size_t run = 0, kept = 0; run < survey.runs.size(); ++run)
    if (!survey.runs[run].steps.empty()) survey.runs[run].lacks_elements = lack[kept++] != 0;
  for (auto& warning : {unlikely_times(survey), short_runs(survey, names_), odd_times(survey, names_),
                        missing_last(survey, names_, steps_)})
    if (warning) survey.warnings.push_back(*warning);
  if (const std::size_t kept = survey.mesh.elements.size(), all = survey.losses.elements; 2 * kept < all)
    survey.warnings.push_back("only " + std::to_string(kept) + " of the reference run's " + std::to_string(all) +
                              " elements exist in all runs, with the same nodes; is a run numbered in another way?");
  const auto box = box_of(extents_, reference_places(survey));
  survey.min = box[0];
  survey.max = box[1];
  return survey;
}

std::vector<std::uint32_t> reference_places(const Survey& survey) {
  std::unordered_map<std::uint32_t, std::uint32_t> place;  // node id -> index in the reference run
  for (std::uint32_t i = 0; i < survey.reference_node_ids.size(); ++i) place.emplace(survey.reference_node_ids[i], i);
  std::vector<std::uint32_t> places;
  for (const std::uint32_t id : survey.mesh.node_ids) places.push_back(place.at(id));
  return places;
}

std::array<std::array<float, 3>, 2> box_of(const std::vector<Extent>& extents,
                                           const std::vector<std::uint32_t>& places) {
  Extent all = empty_extent;
  for (const std::uint32_t place : places) widen(all, extents.at(place));
  return {{{all[0], all[1], all[2]}, {all[3], all[4], all[5]}}};
}
}  // namespace lbea::bake
