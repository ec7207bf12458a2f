#include "tools/bake/earlier_model.hpp"

#include "adapters/simulation/open.hpp"
#include "precompute/jobs/model_run.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <vector>

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
  for (std::size_t i = 0; i < ensemble.runs.size(); ++i) {
    bake::EnsembleRun& run = ensemble.runs[i];
    const auto simulation = simulation_called(model, run.name);
    if (i == ensemble.reference_run || !simulation || !known.contains(run.name)) continue;
    try {
      if (!is_same(run.open()->files(), known.at(run.name))) continue;
    } catch (const Error&) {
      continue;  // said when the run is surveyed
    }
    run.files = known.at(run.name);
    run.rounded_elements = has_rounded_fields(model) ? model.elements() : 0;
    run.source = source_of(*simulation, description.time_factor, place);
    run.open = [source = run.source] { return open_source(source); };
  }
}

std::unique_ptr<bake::SimulationReader> open_source(const std::string& source) {
  if (!source.starts_with(model_scheme)) return io::open_simulation(source);
  std::istringstream text(source.substr(model_scheme.size()));
  std::uint32_t simulation = 0;
  double time_factor = 1;
  std::string file;
  text >> simulation >> time_factor;
  std::getline(text.ignore(1), file);
  return std::make_unique<bake::ModelRun>(opened(file), simulation, time_factor, file);
}

}  // namespace lbea::tool
