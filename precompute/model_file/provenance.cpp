#include "precompute/model_file/provenance.hpp"

#include "precompute/model_file/json_text.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace lbea::bake {
namespace {

std::string hexadecimal(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return json_string(text.data());
}

template <typename Numbers>
std::string numbers(const Numbers& values) {
  std::vector<std::string> texts;
  for (const auto value : values) texts.push_back(json_number(static_cast<double>(value)));
  return json_array(texts);
}

std::string region_json(const RegionDescription& region) {
  JsonObject json;
  if (!region.parts.empty()) json.add("parts", numbers(region.parts));
  if (region.box)
    json.add("box", JsonObject().add("min", numbers(region.box->min)).add("max", numbers(region.box->max)).text());
  if (!region.node_ids.empty()) json.add("listed_nodes", std::to_string(region.node_ids.size()));
  if (!region.sensor.empty()) json.add("visible_to", json_string(region.sensor.filename().string()));
  return json.text();
}

std::string configuration_json(const EnsembleDescription& description, const Ensemble& ensemble) {
  JsonObject json;
  if (description.compact_fields) json.add("compact_fields", "true");
  return json.add("mode", json_string(description.mode == ReferenceMode::impact ? "impact" : "over-time"))
      .add("modes", std::to_string(description.modes))
      .add("reference_run", json_string(ensemble.runs[ensemble.reference_run].name))
      .add("impact_step", std::to_string(description.impact_step))
      .add("region", region_json(description.region))
      .add("time_factor", json_number(description.time_factor))
      .add("envelope_margin", json_number(description.envelope_margin))
      .text();
}

std::string inputs_json(const Ensemble& ensemble, const Survey& survey) {
  std::vector<std::string> runs;
  for (std::size_t run = 0; run < survey.runs.size(); ++run) {
    std::vector<std::string> files;
    for (const InputFile& file : survey.runs[run].files)
      files.push_back(JsonObject()
                          .add("name", json_string(file.name))
                          .add("size", std::to_string(file.size))
                          .add("xxh3_64", hexadecimal(file.hash))
                          .text());
    runs.push_back(
        JsonObject().add("name", json_string(ensemble.runs[run].name)).add("files", json_array(files)).text());
  }
  return json_array(runs);
}

std::string names_json(const std::vector<std::string>& names) {
  std::vector<std::string> texts;
  for (const std::string& name : names) texts.push_back(json_string(name));
  return json_array(texts);
}

std::string basis_json(const std::vector<ReferenceBasis>& references) {
  const auto worst = std::ranges::max_element(references, {}, &ReferenceBasis::residual);
  return JsonObject()
      .add("solver", json_string(worst->solver))
      .add("largest_residual", json_number(worst->residual))
      .text();
}

}  // namespace

std::string provenance_json(const EnsembleDescription& description, const Ensemble& ensemble, const Survey& survey,
                            const std::vector<ReferenceBasis>& references, double kept_variance,
                            const std::vector<std::string>& left_out) {
  JsonObject json;
  json.add("made_by", json_string("lbea-bake " LBEA_VERSION_STRING))
      .add("units",
           JsonObject().add("length", json_string(description.length_unit)).add("time", json_string("s")).text())
      .add("configuration", configuration_json(description, ensemble))
      .add("basis", basis_json(references))
      .add("kept_variance", json_number(kept_variance))
      .add("inputs", inputs_json(ensemble, survey));
  if (!left_out.empty()) json.add("left_out", names_json(left_out));
  return json.text();
}

}  // namespace lbea::bake
