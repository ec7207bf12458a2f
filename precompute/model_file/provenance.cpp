#include "precompute/model_file/model_sections.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace lbea::bake {
namespace {
std::string json_string(std::string_view text) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string json = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      json.append({'\\', c});
    else if (byte < 0x20)
      json.append("\\u00").append({digits[byte / 16], digits[byte % 16]});
    else
      json.push_back(c);
  }
  return json + '"';
}

/// The shortest text that reads back as the same number; null for what is not finite.
std::string json_number(double number) {
  if (!std::isfinite(number)) return "null";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

std::string json_array(const std::vector<std::string>& values) {
  std::string json;
  for (const std::string& value : values) json += (json.empty() ? "" : ",") + value;
  return "[" + json + "]";
}

/// {"key": value, ...} in the order of the calls; values are JSON texts.
class JsonObject {
 public:
  JsonObject& add(std::string_view key, const std::string& value) {
    members_ += (members_.empty() ? "" : ",") + json_string(key) + ":" + value;
    return *this;
  }
  [[nodiscard]] std::string text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

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

std::string file_names_json(std::span<const std::filesystem::path> files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files) names.push_back(json_string(file.filename().string()));
  return json_array(names);
}

std::string region_json(const RegionDescription& region) {
  JsonObject json;
  if (!region.parts.empty()) json.add("parts", numbers(region.parts));
  if (region.box)
    json.add("box", JsonObject().add("min", numbers(region.box->min)).add("max", numbers(region.box->max)).text());
  if (!region.node_ids.empty()) json.add("listed_nodes", std::to_string(region.node_ids.size()));
  if (!region.sensors.empty()) json.add("visible_to", file_names_json(region.sensors));
  return json.text();
}

std::string configuration_json(const BakePlan& plan) {
  const EnsembleDescription& description = plan.description;
  JsonObject json;
  if (description.compact_fields) json.add("compact_fields", "true");
  if (description.rigid.are_set)
    json.add("rigid", description.rigid.ids.empty() ? json_string("fit") : numbers(description.rigid.ids));
  return json.add("mode", json_string(description.mode == ReferenceMode::impact ? "impact" : "over-time"))
      .add("modes", std::to_string(description.modes))
      .add("reference_run", json_string(plan.ensemble.runs[plan.ensemble.reference_run].name))
      .add("impact_step", std::to_string(description.impact_step))
      .add("region", region_json(description.region))
      .add("time_factor", json_number(description.time_factor))
      .add("envelope_margin", json_number(description.margin()))
      .text();
}

std::string inputs_json(const BakePlan& plan) {
  std::vector<std::string> runs;
  for (std::size_t run = 0; run < plan.survey.runs.size(); ++run) {
    std::vector<std::string> files;
    for (const InputFile& file : plan.survey.runs[run].files)
      files.push_back(JsonObject()
                          .add("name", json_string(file.name))
                          .add("size", std::to_string(file.size))
                          .add("xxh3_64", hexadecimal(file.hash))
                          .text());
    runs.push_back(
        JsonObject().add("name", json_string(plan.ensemble.runs[run].name)).add("files", json_array(files)).text());
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

std::string provenance_json(const BakePlan& plan, const std::vector<ReferenceBasis>& references, double kept_variance,
                            const std::vector<std::string>& left_out) {
  JsonObject json;
  json.add("made_by", json_string("lbea-bake " LBEA_VERSION_STRING))
      .add("units",
           JsonObject().add("length", json_string(plan.description.length_unit)).add("time", json_string("s")).text())
      .add("configuration", configuration_json(plan))
      .add("basis", basis_json(references))
      .add("kept_variance", json_number(kept_variance))
      .add("inputs", inputs_json(plan));
  if (!left_out.empty()) json.add("left_out", names_json(left_out));
  return json.text();
}
}  // namespace lbea::bake
