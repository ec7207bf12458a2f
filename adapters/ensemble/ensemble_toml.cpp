#include "adapters/ensemble/ensemble_toml.hpp"

#include "adapters/ensemble/run_list.hpp"
#include "adapters/ensemble/suggestion.hpp"
#include "adapters/ensemble/toml_table.hpp"
#include "adapters/files/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <unordered_set>
#include <utility>

namespace lbea::io {
namespace {

/// The index of the word under `key`; `otherwise` when the key is absent.
std::size_t read_choice(TomlTable& table, const char* key, const std::vector<std::string>& words,
                        std::size_t otherwise) {
  std::string word = words[otherwise];
  table.read(key, word);
  const auto at = std::find(words.begin(), words.end(), word);
  if (at == words.end()) table.fail(key, "cannot be \"" + word + "\"" + suggestion(word, words));
  return static_cast<std::size_t>(at - words.begin());
}

std::vector<std::filesystem::path> read_runs(TomlTable& table) {
  std::vector<std::string> patterns;
  table.read("runs", patterns);
  if (patterns.empty()) table.fail("runs", "is missing or empty: give the runs' paths, or patterns like \"runs/*\"");
  std::vector<std::filesystem::path> runs;
  std::unordered_set<std::string> seen;
  for (const std::string& pattern : patterns) {
    const auto paths = matching_paths(table.folder(), pattern);
    if (paths.empty()) table.fail("runs", "names \"" + pattern + "\", but there is no such file or folder");
    for (const auto& path : paths)
      if (seen.insert(path.native()).second) runs.push_back(path);
  }
  return runs;
}

void exclude_runs(TomlTable& table, std::vector<std::filesystem::path>& runs) {
  std::vector<std::string> excluded;
  table.read("exclude", excluded);
  for (const std::string& name : excluded)
    if (std::erase_if(runs, [&](const auto& run) { return means_run(name, table.folder(), run); }) == 0)
      table.fail("exclude", "names \"" + name + "\", which is none of the runs");
  if (runs.empty()) table.fail("exclude", "leaves no run");
}

void read_reference_run(TomlTable& table, bake::EnsembleDescription& into) {
  std::string name;
  table.read("reference_run", name);
  if (name.empty()) return;
  const auto run = std::find_if(into.runs.begin(), into.runs.end(),
                                [&](const auto& path) { return means_run(name, table.folder(), path); });
  if (run == into.runs.end()) table.fail("reference_run", "is \"" + name + "\", which is none of the runs");
  into.reference_run = *run;
}

/// steps = [0, 4, 8], or a table with first, last, stride.
void read_steps(TomlTable& table, bake::EnsembleDescription& into) {
  into.steps.first = into.impact_step;
  const toml::node* node = table.find("steps");
  if (node == nullptr) return;
  if (node->is_array()) {
    table.read("steps", into.steps.list);
    if (into.steps.list.empty()) table.fail("steps", "is empty");
    std::sort(into.steps.list.begin(), into.steps.list.end());
    const auto repeated = std::adjacent_find(into.steps.list.begin(), into.steps.list.end());
    if (repeated != into.steps.list.end()) table.fail("steps", "names step " + std::to_string(*repeated) + " twice");
    return;
  }
  const auto steps = table.table("steps");
  steps->read("first", into.steps.first);
  steps->read("last", into.steps.last);
  steps->read("stride", into.steps.stride);
  steps->refuse_unknown_keys();
  if (into.steps.stride == 0) steps->fail("stride", "must be at least 1");
  if (into.steps.first > into.steps.last) steps->fail("last", "lies before the first step");
}

void read_box(TomlTable& region, bake::RegionDescription& into) {
  const auto box = region.table("box");
  if (!box) return;
  bake::Box value;
  if (!box->find("min") || !box->find("max")) region.fail("box", "needs min and max, three numbers each");
  box->read("min", value.min);
  box->read("max", value.max);
  box->refuse_unknown_keys();
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (value.min[axis] > value.max[axis]) box->fail("min", "lies above max");
  into.box = value;
}

void read_region(TomlTable& table, bake::RegionDescription& into) {
  const auto region = table.table("region");
  if (!region) return;
  region->read("parts", into.parts);
  read_box(*region, into);
  const toml::node* nodes = region->find("nodes");
  if (nodes != nullptr && nodes->is_string())
    region->read_path("nodes", into.node_file);
  else
    region->read("nodes", into.node_ids);
  region->read_path("sensor", into.sensor);
  region->refuse_unknown_keys();
}

void read_fields(TomlTable& table, std::vector<std::string>& into) {
  const toml::node* fields = table.find("fields");
  if (fields == nullptr || fields->is_array()) return table.read("fields", into);
  std::string word;
  table.read("fields", word);
  if (word != "all") table.fail("fields", "needs a list of names, or \"all\"");
  into = {word};
}

/// time_unit = "ms", or a number of seconds.
void read_time_unit(TomlTable& table, double& factor) {
  const toml::node* unit = table.find("time_unit");
  if (unit != nullptr && unit->is_string()) {
    constexpr std::array<double, 4> seconds{1, 1e-3, 1e-6, 1e-9};
    factor = seconds[read_choice(table, "time_unit", {"s", "ms", "us", "ns"}, 0)];
  } else {
    table.read("time_unit", factor);
  }
  if (factor <= 0) table.fail("time_unit", "must be positive");
}

void read_basis(TomlTable& table, bake::EnsembleDescription& into) {
  into.mode = std::array{ReferenceMode::impact, ReferenceMode::over_time}[read_choice(
      table, "mode", {"impact", "over-time"}, into.mode == ReferenceMode::impact ? 0 : 1)];
  table.read("modes", into.modes);
  if (into.modes == 0) table.fail("modes", "must be at least 1");
}

bake::EnsembleDescription read_description(TomlTable table) {
  bake::EnsembleDescription description;
  description.runs = read_runs(table);
  exclude_runs(table, description.runs);
  read_reference_run(table, description);
  table.read("impact_step", description.impact_step);
  read_steps(table, description);
  read_basis(table, description);
  read_region(table, description.region);
  read_fields(table, description.fields);
  table.read("compact_fields", description.compact_fields);
  table.read_path("parameters", description.parameters);
  table.read("length_unit", description.length_unit);
  if (description.length_unit.empty()) table.fail("length_unit", "is empty");
  read_time_unit(table, description.time_factor);
  table.read("envelope_margin", description.envelope_margin);
  if (description.envelope_margin < 0) table.fail("envelope_margin", "must not be negative");
  table.read("correspondence", description.correspondence);
  if (table.find("landmarks") != nullptr) table.read("landmarks", description.landmarks.emplace());
  table.read_path("views", description.views);
  if (description.views.empty()) description.views = description.region.sensor;
  table.read_path("output", description.output);
  table.refuse_unknown_keys();
  return description;
}

}  // namespace

bake::EnsembleDescription read_ensemble_toml(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  toml::table table;
  try {
    table = toml::parse(as_text(bytes));
  } catch (const toml::parse_error& error) {
    throw Error(Status::bad_input, path.string() + ", line " + std::to_string(error.source().begin.line) + ": " +
                                       std::string(error.description()));
  }
  return read_description(TomlTable(table, path));
}

}  // namespace lbea::io
