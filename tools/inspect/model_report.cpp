#include "tools/inspect/model_report.hpp"

#include "runtime/src/model/mapped_file.hpp"
#include "runtime/src/model/section_reader.hpp"
#include "tools/inspect/hexadecimal.hpp"
#include "tools/inspect/json_words.hpp"

#include <lbea/lbea.hpp>

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdio>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

const char* type_name(std::uint32_t type) {
  constexpr std::array names{"?", "u8", "u32", "u64", "f32", "f64", "u16"};
  return type < names.size() ? names[type] : names[0];
}

Json sizes_json(const Model& model) {
  return {{"reference_mode", model.reference_mode() == ReferenceMode::impact ? "impact" : "over-time"},
          {"references", model.references()},
          {"vertices", model.vertices()},
          {"modes", model.modes()},
          {"samples", model.samples()},
          {"simulations", model.simulations()},
          {"nodes", model.nodes()},
          {"elements", model.elements()},
          {"length_unit", model.length_unit()}};
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

Json provenance_json(const Model& model) {
  Json provenance = Json::parse(model.provenance(), nullptr, false);
  return provenance.is_discarded() ? Json(model.provenance()) : provenance;
}

void print_pairs(const Json& object) {
  for (const auto& [key, value] : object.items()) std::printf("  %-16s %s\n", key.c_str(), text(value).c_str());
}

void print_simulations(const Json& simulations) {
  for (const Json& simulation : simulations) {
    std::printf("  %-16s %3s samples", text(simulation["name"]).c_str(), text(simulation["samples"]).c_str());
    for (const auto& [name, value] : simulation["parameters"].items())
      std::printf("  %s=%s", name.c_str(), text(value).c_str());
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

}  // namespace

Json model_report(const std::filesystem::path& file) {
  const Model model = Model::open(file);
  return {{"file", file.string()},
          {"bytes", std::filesystem::file_size(file)},
          {"sizes", sizes_json(model)},
          {"fields", fields_json(model)},
          {"simulations", simulations_json(model)},
          {"sections", sections_json(file)},
          {"provenance", provenance_json(model)}};
}

void print_model(const std::filesystem::path& file) {
  Json json = model_report(file);
  std::printf("%s: intact, %s bytes\n", text(json["file"]).c_str(), text(json["bytes"]).c_str());
  print_pairs(json["sizes"]);
  std::printf("\nfields\n");
  for (const Json& field : json["fields"])
    std::printf("  %-16s [%s] per %s, %s bits, within %s\n", text(field["name"]).c_str(), text(field["unit"]).c_str(),
                text(field["location"]).c_str(), text(field["bits"]).c_str(), text(field["largest_error"]).c_str());
  std::printf("\nsimulations\n");
  print_simulations(json["simulations"]);
  std::printf("\nsections\n");
  print_sections(json["sections"]);
  std::printf("\nprovenance\n");
  if (json["provenance"].is_object()) json["provenance"].erase("inputs");  // long; --json has them
  print_pairs(json["provenance"].is_object() ? json["provenance"] : Json{{"text", json["provenance"]}});
}

void print_model_json(const std::filesystem::path& file) {
  std::printf("%s\n", model_report(file).dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

}  // namespace lbea::tool
