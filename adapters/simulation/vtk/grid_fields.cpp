#include "adapters/simulation/vtk/grid_fields.hpp"

#include <algorithm>
#include <cctype>

#include "adapters/simulation/vtk/grid_names.hpp"

namespace lbea::io::grid {
namespace {

bool is_number_or_flag(const std::string& name) {
  const auto is_name = [&](const char* known) { return find_array({Array{name, 1, {}}}, known) != nullptr; };
  return std::any_of(node_id_names.begin(), node_id_names.end(), is_name) ||
         std::any_of(element_id_names.begin(), element_id_names.end(), is_name) ||
         std::any_of(part_id_names.begin(), part_id_names.end(), is_name) ||
         std::any_of(alive_names.begin(), alive_names.end(), is_name);
}

/// Without prefix and ending, in small letters.
std::string plain_name(std::string name, std::size_t suffix) {
  name.resize(name.size() - suffix);
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return std::isspace(c) ? '_' : static_cast<char>(std::tolower(c)); });
  if (name.starts_with("2delem_") || name.starts_with("3delem_")) name.erase(0, 7);
  return name;
}

std::string unit_of(const std::string& name) { return name == "plastic_strain" ? "1" : ""; }

FieldSource& field_named(std::vector<FieldSource>& fields, const std::string& name) {
  for (FieldSource& field : fields)
    if (field.field.name == name) return field;
  fields.push_back({{name, unit_of(name)}, {}, {}, {}});
  return fields.back();
}

bool is_field(const Array& array, const std::string& suffix) {
  return array.components == 1 && array.name.size() > suffix.size() && array.name.ends_with(suffix) &&
         !is_number_or_flag(array.name);
}

const Array* source_array(const std::vector<Array>& arrays, const std::string& name, const std::string& suffix) {
  return name.empty() ? nullptr : find_array(arrays, name + suffix);
}

}  // namespace

std::vector<FieldSource> fields_of(const Grid& grid, const std::string& suffix) {
  std::vector<FieldSource> fields;
  for (const Array& array : grid.cell_arrays) {
    if (!is_field(array, suffix)) continue;
    FieldSource& field = field_named(fields, plain_name(array.name, suffix.size()));
    const std::string stem = array.name.substr(0, array.name.size() - suffix.size());
    if (!stem.starts_with("3DELEM_")) field.flat_array = stem;
    if (!stem.starts_with("2DELEM_")) field.solid_array = stem;
  }
  for (const Array& array : grid.point_arrays)
    if (is_field(array, suffix)) {
      FieldSource& field = field_named(fields, plain_name(array.name, suffix.size()));
      if (field.flat_array.empty() && field.solid_array.empty())
        field.point_array = array.name.substr(0, array.name.size() - suffix.size());
    }
  return fields;
}

std::vector<float> field_values(const Grid& grid, const SourcedMesh& sourced, const FieldSource& source,
                                const std::string& suffix) {
  const Array* const flat = source_array(grid.cell_arrays, source.flat_array, suffix);
  const Array* const solid = source_array(grid.cell_arrays, source.solid_array, suffix);
  const Array* const point = source_array(grid.point_arrays, source.point_array, suffix);
  std::vector<float> values(sourced.mesh.elements.size(), 0.0f);
  for (std::size_t e = 0; e < values.size(); ++e) {
    const Array* const cells = sourced.element_is_solid[e] ? solid : flat;
    if (cells != nullptr) values[e] = static_cast<float>(cells->values[sourced.element_source[e]]);
    if (point == nullptr) continue;
    double sum = 0;
    const auto& corners = sourced.mesh.elements[e];
    const std::size_t count = corners[3] == corners[2] ? 3 : 4;
    for (std::size_t c = 0; c < count; ++c) sum += point->values[sourced.node_source[corners[c]]];
    values[e] = static_cast<float>(sum / static_cast<double>(count));
  }
  return values;
}

std::vector<std::uint8_t> alive_elements(const Grid& grid, const SourcedMesh& sourced) {
  std::vector<std::uint8_t> alive(sourced.mesh.elements.size(), 1);
  if (const Array* flags = find_any(grid.cell_arrays, alive_names))
    for (std::size_t e = 0; e < alive.size(); ++e) alive[e] = flags->values[sourced.element_source[e]] != 0 ? 1 : 0;
  return alive;
}

}  // namespace lbea::io::grid
