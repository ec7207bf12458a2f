#include "precompute/provenance.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace lbea {

namespace {

using Json = nlohmann::ordered_json;

std::string hexadecimal(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

Json region_json(const RegionDescription& region) {
  Json json = Json::object();
  if (!region.parts.empty()) json["parts"] = region.parts;
  if (region.box) json["box"] = {{"min", region.box->min}, {"max", region.box->max}};
  if (!region.node_ids.empty()) json["node_ids"] = region.node_ids.size();
  if (!region.sensor.empty()) json["visible_to"] = region.sensor.filename().string();
  return json;
}

Json configuration_json(const EnsembleDescription& description, const Ensemble& ensemble) {
  return {{"mode", description.mode == ReferenceMode::impact ? "impact" : "over-time"},
          {"modes", description.modes},
          {"reference_run", ensemble.runs[ensemble.reference_run].name},
          {"impact_step", description.impact_step},
          {"region", region_json(description.region)},
          {"time_factor", description.time_factor},
          {"envelope_margin", description.envelope_margin}};
}

Json inputs_json(const Ensemble& ensemble, const Survey& survey) {
  Json runs = Json::array();
  for (std::size_t run = 0; run < survey.runs.size(); ++run) {
    Json files = Json::array();
    for (const InputFile& file : survey.runs[run].files)
      files.push_back({{"name", file.name}, {"size", file.size}, {"xxh3_64", hexadecimal(file.hash)}});
    runs.push_back({{"name", ensemble.runs[run].name}, {"files", std::move(files)}});
  }
  return runs;
}

Json basis_json(const std::vector<ReferenceBasis>& references) {
  const auto worst = std::ranges::max_element(references, {}, &ReferenceBasis::residual);
  return {{"solver", worst->solver}, {"largest_residual", worst->residual}};
}

}  // namespace

std::string provenance_json(const EnsembleDescription& description, const Ensemble& ensemble, const Survey& survey,
                            const std::vector<ReferenceBasis>& references, double kept_variance) {
  const Json json{{"made_by", "lbea-bake " LBEA_VERSION_STRING},
                  {"units", {{"length", description.length_unit}, {"time", "s"}}},
                  {"configuration", configuration_json(description, ensemble)},
                  {"basis", basis_json(references)},
                  {"kept_variance", kept_variance},
                  {"inputs", inputs_json(ensemble, survey)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lbea
