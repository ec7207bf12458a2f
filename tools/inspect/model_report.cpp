#include "tools/inspect/reports.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/forecast/learned_forecast.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "runtime/src/model/mapped_file.hpp"
#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/section_reader.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

const char* type_name(std::uint32_t type) {
  constexpr std::array names{"?", "u8", "u32", "u64", "f32", "f64", "u16"};
  return type < names.size() ? names[type] : names[0];
}

/// Of the samples that lack elements of the model, and these elements.
void add_erosion(const Model& model, Json& sizes) {
  if (model.view().eroded.empty()) return;
  std::uint32_t samples = 0;
  std::vector<std::uint8_t> lacked(model.elements());
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const std::vector<std::uint8_t> present = present_elements(model, s);
    samples += std::ranges::find(present, 0) != present.end() ? 1u : 0u;
    for (std::size_t e = 0; e < present.size(); ++e)
      if (present[e] == 0) lacked[e] = 1;
  }
  sizes["elements_some_samples_lack"] = std::ranges::count(lacked, 1);
  sizes["samples_lacking_elements"] = samples;
}

Json sizes_json(const Model& model) {
  Json sizes{{"reference_mode", model.reference_mode() == ReferenceMode::impact ? "impact" : "over-time"},
             {"references", model.references()},
             {"vertices", model.vertices()},
             {"modes", model.modes()},
             {"samples", model.samples()},
             {"simulations", model.simulations()},
             {"nodes", model.nodes()},
             {"elements", model.elements()},
             {"length_unit", model.length_unit()}};
  add_erosion(model, sizes);
  return sizes;
}

/// One per rig that the ensemble was rendered for.
Json views_json(const Model& model) {
  Json views = Json::array();
  const auto add = [&](const DepthImages& images) {
    views.push_back({{"columns", images.camera.columns},
                     {"rows", images.camera.rows},
                     {"T_reference_sensor", images.camera.T_reference_sensor}});
  };
  if (const auto& first = model.view().depth_images) add(*first);
  for (const auto& images : model.view().more_depth_images) add(*images);
  return views;
}

Json fields_json(const Model& model) {
  Json fields = Json::array();
  for (std::uint32_t f = 0; f < model.fields(); ++f)
    fields.push_back({{"name", model.field(f).name},
                      {"unit", model.field(f).unit},
                      {"location", model.field(f).location == FieldInfo::Location::element ? "element" : "node"},
                      {"bits", model.field_values(f, 0).empty() ? 16 : 32},
                      {"largest_error", model.field(f).largest_error}});
  return fields;
}

/// As many digits as distinguish the value from others of single precision.
double shortest(float value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
  double result = 0;
  std::from_chars(digits, end, result);
  return result;
}

/// What the bake learned from left-out runs for Method::fit. Lengths in the length unit; 0: not known or not used.
Json learned_json(const Model& model) {
  const auto& images = model.view().depth_images;
  if (images == nullptr) return nullptr;
  Json learned{{"cap", shortest(images->metric.cap)},
               {"one_sided", shortest(images->metric.one_sided)},
               {"hidden_price", shortest(images->metric.hidden)},
               {"residual_price", shortest(images->prices.residual)},
               {"distance_price", shortest(images->prices.distance)},
               {"change_price", shortest(images->prices.change)},
               {"change_distance_price", shortest(images->prices.change_distance)},
               {"neighbor_price", shortest(images->prices.neighbor)},
               {"correction_price", shortest(images->prices.correction)},
               {"frame_misfit_limit", shortest(images->misfit_limit)},
               {"test_misfit_limit", shortest(images->test_misfit_limit)},
               {"error_90_per_spread", images->error_bound.per_spread},
               {"hidden_error_90_per_spread", images->hidden_error_bound.per_spread},
               {"error_90_growth", images->error_bound.growth},
               {"hidden_error_90_growth", images->hidden_error_bound.growth},
               {"regression_share", shortest(images->regression.blend)},
               {"hidden_regression_share", shortest(images->regression.hidden_blend)},
               {"pose_variance", shortest(images->pose_variance)},
               {"drift_evidence", images->pose_errors.drift_evidence},
               {"time_variation", shortest(images->time_variation)}};
  if (images->pose_errors_by_points)
    learned["drift_evidence_with_points"] = images->pose_errors_by_points->drift_evidence;
  for (std::size_t i = 0; i < images->bounds.size(); ++i) {
    const std::string name = i == 0 ? "position" : std::string(model.field(static_cast<std::uint32_t>(i - 1)).name);
    learned[name + "_bound_per_spread"] = images->bounds[i].per_spread;
    learned[name + "_common_share"] = images->bounds[i].share;
  }
  return learned;
}

/// Of left-out runs seen completely until each tenth of a simulation's duration, first of those not seen at all: the
/// bound of the final shape's error; per parameter the explained share of the variance and the bound. Null: no
/// forecasts.
Json forecast_json(const Model& model) {
  const auto& forecast = model.view().forecast;
  if (forecast == nullptr) return nullptr;
  const std::size_t stride = LearnedForecast::numbers_per_window(model.parameters());
  const auto over_time = [&](std::size_t number) {
    Json values = Json::array({forecast->numbers[number]});
    for (std::size_t node = 1; node <= LearnedForecast::nodes; ++node)
      values.push_back(forecast->numbers[(1 + ForecastWindow{1, node}.number()) * stride + number]);
    return values;
  };
  Json parameters = Json::object();
  for (std::uint32_t p = 0; p < model.parameters(); ++p)
    parameters[std::string(model.parameter_name(p))] = {{"r2", over_time(2 + 3 * std::size_t{p})},
                                                        {"bound_90", over_time(3 + 3 * std::size_t{p})}};
  return {{"error_90", over_time(0)}, {"parameters", std::move(parameters)}};
}

Json simulations_json(const Model& model) {
  std::vector<std::uint32_t> samples(model.simulations());
  for (std::uint32_t s = 0; s < model.samples(); ++s) ++samples[model.sample(s).simulation];
  Json simulations = Json::array();
  for (std::uint32_t i = 0; i < model.simulations(); ++i) {
    Json parameters = Json::object();
    for (std::uint32_t p = 0; p < model.parameters(); ++p) {
      const double value = model.parameter(i, p);
      parameters[std::string(model.parameter_name(p))] = std::isnan(value) ? Json() : Json(value);
    }
    simulations.push_back(
        {{"name", model.simulation_name(i)}, {"samples", samples[i]}, {"parameters", std::move(parameters)}});
  }
  return simulations;
}

Json sections_json(const std::filesystem::path& file) {
  const MappedFile mapping(file);
  const SectionReader reader(mapping.bytes(), file.string(), release_pages);
  Json sections = Json::array();
  for (const format::SectionEntry& entry : reader.entries()) {
    Json shape = Json::array();
    for (std::size_t i = 0; i < entry.rank; ++i) shape.push_back(entry.shape[i]);
    sections.push_back({{"id", entry.id},
                        {"title", title(static_cast<format::SectionId>(entry.id))},
                        {"part", entry.part},
                        {"type", type_name(entry.element_type)},
                        {"shape", std::move(shape)},
                        {"offset", entry.offset},
                        {"bytes", entry.length},
                        {"xxh3_64", hexadecimal(entry.checksum)}});
  }
  return sections;
}

// Deeper nesting than a bake writes stays text, because printing it would need as much stack.
Json provenance_json(const Model& model) {
  constexpr int most_levels = 32;
  bool is_deep = false;
  const auto is_kept = [&](int level, Json::parse_event_t, Json&) {
    is_deep |= level > most_levels;
    return !is_deep;
  };
  Json provenance = Json::parse(model.provenance(), is_kept, false);
  return is_deep || provenance.is_discarded() ? Json(model.provenance()) : provenance;
}

void print_pairs(const Json& object) {
  for (const auto& [key, value] : object.items())
    std::printf("  %-26s %s\n", printable(key).c_str(), text(value).c_str());
}

void print_simulations(const Json& simulations) {
  for (const Json& simulation : simulations) {
    std::printf("  %-16s %3s samples", text(simulation["name"]).c_str(), text(simulation["samples"]).c_str());
    for (const auto& [name, value] : simulation["parameters"].items())
      std::printf("  %s=%s", printable(name).c_str(), text(value).c_str());
    std::printf("\n");
  }
}

void print_sections(const Json& sections) {
  std::printf("  %4s %-18s %4s %-4s %-20s %12s  %s\n", "id", "title", "part", "type", "shape", "bytes", "xxh3-64");
  for (const Json& section : sections)
    std::printf("  %4s %-18s %4s %-4s %-20s %12s  %s\n", text(section["id"]).c_str(), text(section["title"]).c_str(),
                text(section["part"]).c_str(), text(section["type"]).c_str(), text(section["shape"]).c_str(),
                text(section["bytes"]).c_str(), text(section["xxh3_64"]).c_str());
}

Json channels_json(const Model& model) {
  Json list = Json::array();
  for (std::uint32_t c = 0; c < model.channels(); ++c) {
    const ChannelInfo info = model.channel(c);
    const ChannelRow row = model.view().channels->row(c);
    const bool is_statistic = is_of_field(info.kind), is_history = info.kind == ChannelKind::history;
    list.push_back({{"name", info.name},
                    {"unit", info.unit},
                    {"kind", to_string(info.kind)},
                    {"component", to_string(info.component)},
                    {"cfc", info.cfc},
                    {"nodes", std::vector<std::uint32_t>(row.node_ids.begin(), row.node_ids.begin() + row.nodes)},
                    {"field", is_statistic ? Json(model.field(row.field()).name) : Json()},
                    {"elements", is_statistic ? row.elements() : 0},
                    {"history", is_history ? Json(model.view().channels->history(c).text()) : Json()}});
  }
  return list;
}

void print_channels(const Json& channels) {
  for (const Json& channel : channels) {
    std::printf("  %-16s [%s] %s ", text(channel["name"]).c_str(), text(channel["unit"]).c_str(),
                text(channel["kind"]).c_str());
    if (!channel["history"].is_null())
      std::printf("%s, CFC %s\n", text(channel["history"]).c_str(), text(channel["cfc"]).c_str());
    else if (channel["field"].is_null())
      std::printf("%s of nodes %s, CFC %s\n", text(channel["component"]).c_str(), channel["nodes"].dump().c_str(),
                  text(channel["cfc"]).c_str());
    else
      std::printf("of %s on %s elements\n", text(channel["field"]).c_str(), text(channel["elements"]).c_str());
  }
}

/// Everything but the large arrays. Verifies the whole file first.
Json model_report(const std::filesystem::path& file) {
  const Model model = Model::open(file);
  return {{"file", file.string()},
          {"bytes", std::filesystem::file_size(file)},
          {"sizes", sizes_json(model)},
          {"views", views_json(model)},
          {"fields", fields_json(model)},
          {"learned", learned_json(model)},
          {"forecast", forecast_json(model)},
          {"channels", channels_json(model)},
          {"simulations", simulations_json(model)},
          {"sections", sections_json(file)},
          {"provenance", provenance_json(model)}};
}

/// The objects of a list in a report by the name that `key` returns for each.
std::map<std::string, Json> by_name(const Json& list, const auto& key) {
  std::map<std::string, Json> result;
  for (const Json& item : list) result.emplace(key(item), item);
  return result;
}

/// Each run with its samples, its parameters and the hashes of its files.
std::map<std::string, Json> runs_of(const Json& report) {
  auto runs = by_name(report["simulations"], [](const Json& run) { return run["name"].get<std::string>(); });
  if (report["provenance"].is_object() && report["provenance"].contains("inputs"))
    for (const Json& input : report["provenance"]["inputs"])
      if (const auto run = runs.find(input.value("name", "")); run != runs.end()) run->second["files"] = input["files"];
  return runs;
}

std::map<std::string, Json> sections_of(const Json& report) {
  auto sections = by_name(report["sections"], [](const Json& section) {
    return section["title"].get<std::string>() + " " + text(section["part"]);
  });
  for (auto& [name, section] : sections) section.erase("offset");  // changes with the sections before it
  return sections;
}

Json settings_of(const Json& report) {
  Json settings = report["sizes"];
  if (!report["provenance"].is_object()) return settings;
  for (const auto& [key, value] : report["provenance"].items())
    if (key != "inputs") settings[key] = value;
  return settings;
}

Json changes_of_settings(const Json& before, const Json& after) {
  Json changes = Json::object();
  for (const auto& [key, value] : before.items())
    if (!after.contains(key) || after[key] != value)
      changes[key] = {{"before", value}, {"after", after.value(key, Json())}};
  for (const auto& [key, value] : after.items())
    if (!before.contains(key)) changes[key] = {{"before", Json()}, {"after", value}};
  return changes;
}

/// Names that are new, removed, or have another content.
Json changes_of(const std::map<std::string, Json>& before, const std::map<std::string, Json>& after) {
  Json added = Json::array(), withdrawn = Json::array(), changed = Json::array();
  for (const auto& [name, value] : after)
    if (!before.contains(name)) added.push_back(name);
  for (const auto& [name, value] : before) {
    const auto other = after.find(name);
    if (other == after.end())
      withdrawn.push_back(name);
    else if (other->second != value)
      changed.push_back(name);
  }
  return {{"added", added}, {"withdrawn", withdrawn}, {"changed", changed}};
}

Json diff(const std::filesystem::path& before, const std::filesystem::path& after) {
  const Json first = model_report(before), second = model_report(after);
  Json result{{"before", before.string()}, {"after", after.string()}};
  result["runs"] = changes_of(runs_of(first), runs_of(second));
  result["settings"] = changes_of_settings(settings_of(first), settings_of(second));
  result["sections"] = changes_of(sections_of(first), sections_of(second));
  bool is_same = result["settings"].empty();
  for (const char* what : {"runs", "sections"})
    for (const Json& names : result[what]) is_same = is_same && names.empty();
  result["same"] = is_same;
  return result;
}

void print_names(const char* what, const Json& changes) {
  for (const auto& [kind, names] : changes.items())
    for (const Json& name : names) std::printf("%-8s %-9s  %s\n", what, printable(kind).c_str(), text(name).c_str());
}

}  // namespace

void print_model(const std::filesystem::path& file, bool as_json) {
  Json json = model_report(file);
  if (as_json) return void(std::puts(pretty(json).c_str()));
  std::printf("%s: intact, %s bytes\n", text(json["file"]).c_str(), text(json["bytes"]).c_str());
  print_pairs(json["sizes"]);
  std::printf("\nfields\n");
  for (const Json& field : json["fields"])
    std::printf("  %-16s [%s] per %s, %s bits, within %s\n", text(field["name"]).c_str(), text(field["unit"]).c_str(),
                text(field["location"]).c_str(), text(field["bits"]).c_str(), text(field["largest_error"]).c_str());
  if (!json["channels"].empty()) std::printf("\nchannels\n");
  print_channels(json["channels"]);
  if (json["learned"].is_object()) std::printf("\nlearned from left-out runs\n");
  print_pairs(json["learned"]);
  std::printf("\nsimulations\n");
  print_simulations(json["simulations"]);
  std::printf("\nsections\n");
  print_sections(json["sections"]);
  std::printf("\nprovenance\n");
  if (json["provenance"].is_object()) json["provenance"].erase("inputs");  // long; printed by --json
  print_pairs(json["provenance"].is_object() ? json["provenance"] : Json{{"text", json["provenance"]}});
}

void print_diff(const std::filesystem::path& before, const std::filesystem::path& after, bool as_json) {
  const Json changes = diff(before, after);
  if (as_json) return void(std::puts(pretty(changes).c_str()));
  if (changes["same"].get<bool>())
    return void(std::printf("%s and %s hold the same\n", before.string().c_str(), after.string().c_str()));
  print_names("run", changes["runs"]);
  for (const auto& [key, change] : changes["settings"].items())
    std::printf("%-8s %-9s  %s: %s -> %s\n", "setting", "changed", printable(key).c_str(),
                text(change["before"]).c_str(), text(change["after"]).c_str());
  print_names("section", changes["sections"]);
}

}  // namespace lbea::tool
