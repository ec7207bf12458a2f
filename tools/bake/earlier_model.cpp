#include "tools/bake/steps.hpp"

#include "precompute/survey/common_mesh.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/ensemble/model_mesh.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <sstream>

namespace lbea::tool {
namespace {

const std::string model_scheme = "lbea-model:";  // then simulation, time factor and path, with blanks between

/// Opened once, verified once: its samples are read from the mapping.
Model opened(const std::filesystem::path& file) {
  static std::mutex mutex;
  static std::map<std::filesystem::path, Model> models;
  const std::lock_guard lock(mutex);
  const auto found = models.find(file);
  return found != models.end() ? found->second : models.emplace(file, Model::open(file)).first->second;
}

// The time whose product with the factor is exactly `seconds`; division alone may differ in the last bit.
double in_units(double seconds, double factor) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double time = seconds / factor;
  for (const double near : {time, std::nextafter(time, infinity), std::nextafter(time, -infinity)})
    if (near * factor == seconds) return near;
  return time;
}

/// A simulation of a finished model, read like the run that it was baked from: common mesh and samples.
class ModelRun : public bake::SimulationReader {
 public:
  /// time_factor: seconds per unit of the run's times, as the model was baked with. file: the model's.
  ModelRun(Model model, std::uint32_t simulation, double time_factor, std::filesystem::path file)
      : model_(std::move(model)),
        simulation_(simulation),
        time_factor_(time_factor),
        file_(std::move(file)),
        mesh_(mesh_of(model_)) {
    mesh_.is_continued = true;
    for (std::uint32_t field = 0; field < model_.fields(); ++field)
      if (model_.field(field).location == FieldInfo::Location::element)
        fields_.push_back({std::string(model_.field(field).name), std::string(model_.field(field).unit)});
    for (std::uint32_t s = 0; s < model_.samples(); ++s)
      if (model_.sample(s).simulation == simulation_) states_ = model_.sample(s).time_step + 1;
  }

  const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return states_; }
  /// This and read() throw Error{bad_config} for a state that is not one of the model's samples.
  double time_s(std::uint32_t state) const override {
    return in_units(model_.sample_time_s(sample(state)), time_factor_);
  }
  void read(std::uint32_t state, bake::SimulationState& into) override {
    const std::uint32_t place = sample(state);
    const auto positions = model_.node_positions(place);
    into.time_s = time_s(state);
    into.positions.assign(positions.begin(), positions.end());
    into.alive = present_elements(model_, place);
    if (into.alive.empty()) into.alive.assign(model_.elements(), 1);
    into.fields.resize(fields_.size());
    for (std::uint32_t field = 0, next = 0; field < model_.fields(); ++field) {
      if (model_.field(field).location != FieldInfo::Location::element) continue;
      into.fields[next].resize(model_.field_size(field));
      model_.read_field(field, place, into.fields[next++]);
    }
  }
  std::vector<std::filesystem::path> files() const override { return {file_}; }

 private:
  [[nodiscard]] std::uint32_t sample(std::uint32_t state) const {
    const std::uint32_t place = model_.sample_index({simulation_, state});
    if (place == model_.samples())
      throw Error(Status::bad_config, file_.string() + " does not hold state " + std::to_string(state) + " of run " +
                                          std::string(model_.simulation_name(simulation_)) +
                                          "; select the steps it was baked with, or read the run itself");
    return place;
  }

  Model model_;
  std::uint32_t simulation_;
  double time_factor_;
  std::filesystem::path file_;
  bake::SimulationMesh mesh_;
  std::vector<bake::SimulationField> fields_;
  std::uint32_t states_ = 0;
};

std::string source_of(std::uint32_t simulation, double time_factor, const std::filesystem::path& file) {
  std::ostringstream source;
  source.precision(17);
  source << model_scheme << simulation << ' ' << time_factor << ' ' << file.string();
  return source.str();
}

/// Per run of the model: its files, as its provenance has them.
std::map<std::string, std::vector<bake::InputFile>> files_of_runs(const nlohmann::json& provenance) {
  std::map<std::string, std::vector<bake::InputFile>> runs;
  for (const auto& run : provenance.at("inputs"))
    for (const auto& file : run.at("files"))
      runs[run.at("name").get<std::string>()].push_back(
          {file.at("name").get<std::string>(), file.at("size").get<std::uint64_t>(),
           std::stoull(file.at("xxh3_64").get<std::string>(), nullptr, 16)});
  return runs;
}

bool is_same(const std::vector<std::filesystem::path>& present, const std::vector<bake::InputFile>& known) {
  return std::ranges::equal(present, known, [](const std::filesystem::path& file, const bake::InputFile& as_baked) {
    return file.filename() == as_baked.name && std::filesystem::file_size(file) == as_baked.size;
  });
}

std::optional<std::uint32_t> simulation_called(const Model& model, const std::string& name) {
  for (std::uint32_t i = 0; i < model.simulations(); ++i)
    if (model.simulation_name(i) == name) return i;
  return std::nullopt;
}

bool has_rounded_fields(const Model& model) {
  for (std::uint32_t field = 0; field < model.fields(); ++field)
    if (model.field_values(field, 0).empty()) return true;
  return false;
}

void check_fits(const Model& model, const nlohmann::json& provenance, const bake::EnsembleDescription& description,
                const std::string& file) {
  if (model.length_unit() != description.length_unit ||
      provenance.at("configuration").at("time_factor").get<double>() != description.time_factor)
    throw Error(Status::bad_config, file + " was baked with another unit of length or time; bake without it");
  if (provenance.at("configuration").contains("rigid") && !description.rigid.are_set)
    throw Error(Status::bad_config, file + " was baked with `rigid`; set it here, too, or bake without --from");
  if (has_rounded_fields(model) && !description.compact_fields)
    throw Error(
        Status::bad_config,
        file + " has its fields in 16 bits, what was rounded away is gone; bake with compact_fields, or without it");
}

}  // namespace

void take_from_model(bake::Ensemble& ensemble, const bake::EnsembleDescription& description,
                     const std::filesystem::path& file) {
  const std::filesystem::path place = std::filesystem::absolute(file);
  const Model model = opened(place);
  const auto provenance = nlohmann::json::parse(model.provenance(), nullptr, false);
  if (provenance.is_discarded() || !provenance.contains("inputs"))
    throw Error(Status::bad_config, file.string() + " does not say what it was baked from; bake without it");
  check_fits(model, provenance, description, file.string());
  const auto known = files_of_runs(provenance);
  // Runs with other meshes are mapped again: by these settings, onto this reference run, and reported.
  const bake::SimulationMesh reference = ensemble.runs[ensemble.reference_run].open()->mesh();
  check_mesh(reference, ensemble.runs[ensemble.reference_run].name);
  if (!has_numbers_of(mesh_of(model), reference)) return;
  if (!description.channels.empty() || description.rigid.are_set) return;  // need states that a model lacks
  for (std::size_t i = 0; i < ensemble.runs.size(); ++i) {
    bake::EnsembleRun& run = ensemble.runs[i];
    const auto simulation = simulation_called(model, run.name);
    if (i == ensemble.reference_run || !simulation || !known.contains(run.name)) continue;
    try {
      const auto reader = run.open();
      if (!is_same(all_files(*reader), known.at(run.name))) continue;
      check_mesh(reader->mesh(), run.name);
      if (!has_numbers_of(reference, reader->mesh())) continue;
    } catch (const Error&) {
      continue;  // reported when the run is surveyed
    }
    run.own = std::make_shared<const bake::EnsembleRun>(run);
    run.files = known.at(run.name);
    run.rounded_elements = has_rounded_fields(model) ? model.elements() : 0;
    run.source = source_of(*simulation, description.time_factor, place);
    run.open = [source = run.source] { return open_source(source); };
  }
}

std::unique_ptr<bake::SimulationReader> open_source(const std::string& source) {
  if (!source.starts_with(model_scheme)) return open_run(source);
  std::istringstream text(source.substr(model_scheme.size()));
  std::uint32_t simulation = 0;
  double time_factor = 1;
  std::string file;
  text >> simulation >> time_factor;
  std::getline(text.ignore(1), file);
  return std::make_unique<ModelRun>(opened(file), simulation, time_factor, file);
}

}  // namespace lbea::tool
