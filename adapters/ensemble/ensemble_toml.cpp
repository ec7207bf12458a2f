#include "adapters/ensemble/ensemble_toml.hpp"

#include "adapters/ensemble/toml_table.hpp"

#include <algorithm>
#include <cerrno>
#include <unordered_set>

#include <fnmatch.h>
#include <glob.h>

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
  if (!table.has("steps")) return;
  if (table.is_list("steps")) {
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
  if (!box->has("min") || !box->has("max")) region.fail("box", "needs min and max, three numbers each");
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
  if (region->is_text("nodes"))
    region->read_path("nodes", into.node_file);
  else
    region->read("nodes", into.node_ids);
  if (region->has("sensor")) region->read_path("sensor", into.sensors.emplace_back());
  region->refuse_unknown_keys();
}

/// mapping.parts = {101 = 1}, or "ignore".
void read_mapped_parts(TomlTable& mapping, bake::MappingSettings& into) {
  if (!mapping.is_text("parts")) return mapping.read("parts", into.parts);
  std::string word;
  mapping.read("parts", word);
  if (word != "ignore") mapping.fail("parts", "needs a table like {101 = 1}, or \"ignore\"");
  into.by_part = false;
}

/// rigid = "fit", or [12, 40, 7]
void read_rigid(TomlTable& table, bake::BodyFrameNodes& nodes) {
  if (!table.has("rigid")) return;
  nodes.are_set = true;
  if (table.is_list("rigid")) {
    table.read("rigid", nodes.ids);
    if (nodes.ids.size() < 3) table.fail("rigid", "needs three nodes or more");
  } else {
    std::string word;
    table.read("rigid", word);
    if (word != "fit") table.fail("rigid", "needs \"fit\", or node ids like [12, 40, 7]");
  }
}

void read_mapping(TomlTable& table, bake::MappingSettings& into) {
  const auto mapping = table.table("mapping");
  if (!mapping) return;
  mapping->read("enabled", into.enabled);
  if (mapping->has("distance")) mapping->read("distance", into.distance.emplace());
  mapping->read("share", into.share);
  read_mapped_parts(*mapping, into);
  mapping->refuse_unknown_keys();
  if (into.distance.value_or(1) <= 0) mapping->fail("distance", "must be positive");
  if (!(into.share > 0 && into.share <= 1)) mapping->fail("share", "must lie above 0 and not above 1");
}

void read_fields(TomlTable& table, std::vector<std::string>& into) {
  if (!table.has("fields") || table.is_list("fields")) {
    table.read("fields", into);
    for (auto field = into.begin(); field != into.end(); ++field)
      if (std::find(into.begin(), field, *field) != field) table.fail("fields", "names \"" + *field + "\" twice");
    return;
  }
  std::string word;
  table.read("fields", word);
  if (word != "all") table.fail("fields", "needs a list of names, or \"all\"");
  into = {word};
}

/// time_unit = "ms", or a number of seconds.
void read_time_unit(TomlTable& table, double& factor) {
  if (table.is_text("time_unit")) {
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

std::vector<std::string> words(std::span<const std::string_view> names) { return {names.begin(), names.end()}; }

/// Of a minimum, maximum or mean.
void read_elements(TomlTable& table, bake::ChannelDescription& channel) {
  table.read("field", channel.field);
  for (const auto& [key, ids] : {std::pair{"parts", &channel.parts}, std::pair{"elements", &channel.elements}}) {
    table.read(key, *ids);
    if (table.has(key) && ids->empty()) table.fail(key, "is empty; remove it for all, or name some");
  }
}

/// history = "part_mass", part = 5
void read_history(TomlTable& table, bake::ChannelDescription& channel) {
  table.read("history", channel.history.name);
  table.read("unit", channel.unit);
  const bool is_history = channel.kind == ChannelKind::history;
  if (is_history && channel.history.name.empty())
    table.fail("history", "is missing; name one, like \"internal_energy\": a wrong name lists those of the run");
  if (table.has("part") && table.has("wall")) table.fail("wall", "stands beside part; give one of them");
  for (const auto& [key, owner] : {std::pair{"part", HistoryOwner::part}, std::pair{"wall", HistoryOwner::wall}}) {
    if (!table.has(key)) continue;
    if (!is_history) table.fail(key, "is for channels of kind \"history\" only");
    table.read(key, channel.history.number);
    channel.history.owner = owner;
  }
}

bake::ChannelDescription read_channel(TomlTable& table) {
  bake::ChannelDescription channel;
  table.read("name", channel.name);
  if (channel.name.empty()) table.fail("name", "is missing or empty");
  if (!table.has("kind")) table.fail("kind", "is missing" + suggestion("", words(channel_kind_names)));
  channel.kind = static_cast<ChannelKind>(read_choice(table, "kind", words(channel_kind_names), 0));
  channel.component = static_cast<ChannelComponent>(
      read_choice(table, "component", words(channel_component_names), channel_component_names.size() - 1));
  table.read("cfc", channel.cfc);
  std::vector<NumberOrPlace> points;
  table.read("points", points);
  for (const NumberOrPlace& point : points) {
    const auto* number = std::get_if<std::uint32_t>(&point);
    channel.points.push_back(number != nullptr ? bake::ChannelPoint{true, *number, {}}
                                               : bake::ChannelPoint{false, 0, std::get<std::array<double, 3>>(point)});
  }
  if (table.has("reach")) table.read("reach", channel.reach.emplace());
  read_elements(table, channel);
  read_history(table, channel);
  table.refuse_unknown_keys();
  return channel;
}

/// views = "front.json", or ["left.json", "right.json"] for several rigs
void read_views(TomlTable& table, bake::EnsembleDescription& description) {
  if (!table.is_list("views")) return table.read_path("views", description.depth_sensor);
  std::vector<std::string> sensors;
  table.read("views", sensors);
  if (sensors.empty() || std::ranges::count(sensors, "") > 0) table.fail("views", "is empty or names an empty file");
  for (const std::string& sensor : sensors) {
    const auto file = (table.folder() / sensor).lexically_normal();
    if (description.depth_sensor.empty())
      description.depth_sensor = file;
    else
      description.more_depth_sensors.push_back(file);
  }
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
  read_mapping(table, description.mapping);
  read_fields(table, description.fields);
  table.read("compact_fields", description.compact_fields);
  table.read_path("parameters", description.parameters);
  table.read("length_unit", description.length_unit);
  if (description.length_unit.empty()) table.fail("length_unit", "is empty");
  read_time_unit(table, description.time_factor);
  if (table.has("envelope_margin")) table.read("envelope_margin", description.envelope_margin.emplace());
  if (description.envelope_margin.value_or(0) < 0) table.fail("envelope_margin", "must not be negative");
  table.read("correspondence", description.correspondence);
  if (table.has("landmarks")) table.read("landmarks", description.landmarks.emplace());
  for (TomlTable& channel : table.tables("channel")) description.channels.push_back(read_channel(channel));
  read_rigid(table, description.rigid);
  read_views(table, description);
  if (description.depth_sensor.empty() && !description.region.sensors.empty())
    description.depth_sensor = description.region.sensors.front();
  table.read_path("output", description.output);
  table.refuse_unknown_keys();
  return description;
}

struct GlobResult {
  glob_t value{};
  ~GlobResult() { globfree(&value); }
};

/// Escapes characters of a pattern in the name of a folder.
std::string literal(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '*' || c == '?' || c == '[' || c == ']' || c == '\\') text += '\\';
    text += c;
  }
  return text;
}

std::filesystem::path without_trailing_slash(const std::filesystem::path& path) {
  return path.has_filename() ? path : path.parent_path();
}
}  // namespace

bake::EnsembleDescription read_ensemble_toml(const std::filesystem::path& path) {
  return read_description(TomlTable(path));
}

std::vector<std::filesystem::path> matching_paths(const std::filesystem::path& folder, const std::string& pattern) {
  const bool is_absolute = std::filesystem::path(pattern).is_absolute();
  const std::string base = is_absolute || folder.empty() ? "" : literal(folder.string()) + "/";
  GlobResult found;
  const auto stops = [](const char*, int error) {
    return error == ENOENT ? 0 : 1;
  };  // a missing folder matches nothing
  const int outcome = ::glob((base + pattern).c_str(), GLOB_NOSORT, stops, &found.value);
  if (outcome != 0 && outcome != GLOB_NOMATCH)
    throw Error(Status::bad_input, "cannot read the folders of \"" + pattern + "\" in " +
                                       (folder.empty() ? "." : folder.string()) + "; check their rights");
  std::vector<std::filesystem::path> paths;
  for (std::size_t i = 0; i < found.value.gl_pathc; ++i)
    paths.push_back(without_trailing_slash(std::filesystem::path(found.value.gl_pathv[i]).lexically_normal()));
  std::sort(paths.begin(), paths.end());  // by bytes, not by the locale
  return paths;
}

bool means_run(const std::string& name, const std::filesystem::path& folder, const std::filesystem::path& run) {
  const auto matches = [&](const std::filesystem::path& path) {
    return ::fnmatch(path.c_str(), run.c_str(), FNM_PATHNAME) == 0 || path == run;
  };
  if (matches(without_trailing_slash((literal(folder.string()) / std::filesystem::path(name)).lexically_normal())))
    return true;
  return ::fnmatch(name.c_str(), run.filename().c_str(), FNM_PATHNAME) == 0;
}
}  // namespace lbea::io
