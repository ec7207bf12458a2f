#include "adapters/simulation/grid/grid_mesh.hpp"

#include "adapters/simulation/surface.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <set>

namespace lbea::io::grid {
namespace {
// Names of arrays with ids and flags, in the spellings of several programs; case is ignored.
constexpr std::array node_id_names{"NODE_ID", "NodeID", "GlobalNodeId"};
constexpr std::array element_id_names{"ELEMENT_ID", "ElementID", "GlobalElementId"};
constexpr std::array part_id_names{"PART_ID", "PartID", "part"};
constexpr std::array alive_names{"EROSION_STATUS", "alive"};

/// The first of these with one component; nullptr when there is none.
template <typename Names>
const Array* find_any(const std::vector<Array>& arrays, const Names& names) {
  for (const char* name : names)
    if (const Array* array = find_array(arrays, name); array != nullptr && array->components == 1) return array;
  return nullptr;
}

using Points = std::span<const std::uint32_t>;

/// Ids of points or cells, or 1, 2, 3 ... without an array.
template <typename Names>
std::vector<std::uint32_t> ids_of(const std::vector<Array>& arrays, const Names& names, std::size_t rows,
                                  const std::string& file) {
  std::vector<std::uint32_t> ids(rows);
  const Array* array = find_any(arrays, names);
  if (array == nullptr) {
    std::iota(ids.begin(), ids.end(), 1u);
    return ids;
  }
  for (std::size_t i = 0; i < rows; ++i) {
    const double id = array->values[i];
    if (!(id >= 0 && id < 4294967295.0 && id == std::floor(id)))
      throw Error{Status::bad_input, file + ": row " + std::to_string(i) + " of \"" + array->name +
                                         "\" is not an id; the file is damaged, export it again"};
    ids[i] = static_cast<std::uint32_t>(id);
  }
  return ids;
}

/// The cells as quads and hexahedra, each with the index of its cell.
struct Shapes {
  std::vector<Quad> flats;
  std::vector<Hexahedron> solids;
  std::vector<std::uint32_t> flat_cells, solid_cells;

  void add_flat(std::uint32_t cell, const Quad& quad) {
    flats.push_back(quad);
    flat_cells.push_back(cell);
  }
  void add_solid(std::uint32_t cell, const Hexahedron& solid) {
    solids.push_back(solid);
    solid_cells.push_back(cell);
  }
};

void add_fan(Shapes& shapes, std::uint32_t cell, Points p) {
  if (p.size() == 4) return shapes.add_flat(cell, {p[0], p[1], p[2], p[3]});
  for (std::size_t i = 2; i < p.size(); ++i) shapes.add_flat(cell, {p[0], p[i - 1], p[i], p[i]});
}

void add_strip(Shapes& shapes, std::uint32_t cell, Points p) {
  for (std::size_t i = 2; i < p.size(); ++i) {
    const bool is_even = i % 2 == 0;
    shapes.add_flat(cell, {p[is_even ? i - 2 : i - 1], p[is_even ? i - 1 : i - 2], p[i], p[i]});
  }
}

void add_cell(Shapes& shapes, std::uint32_t cell, CellKind kind, Points p, const std::string& file) {
  const CellShape* const shape = shape_of(kind);
  if (shape == nullptr)
    throw Error{Status::unsupported_input, file + ", cell " + std::to_string(cell) + ": cells of VTK's kind " +
                                               std::to_string(static_cast<int>(kind)) +
                                               " are not read; convert the mesh to triangles and quads"};
  const auto& c = shape->corners;
  if (shape->form == CellForm::flat) shapes.add_flat(cell, {p[c[0]], p[c[1]], p[c[2]], p[c[3]]});
  if (shape->form == CellForm::solid)
    shapes.add_solid(cell, {p[c[0]], p[c[1]], p[c[2]], p[c[3]], p[c[4]], p[c[5]], p[c[6]], p[c[7]]});
  if (shape->form == CellForm::polygon) add_fan(shapes, cell, p);
  if (shape->form == CellForm::strip) add_strip(shapes, cell, p);
}

Shapes shapes_of(const Grid& grid, const std::vector<std::uint32_t>& element_ids, const std::string& file) {
  Shapes shapes;
  for (std::uint32_t c = 0; c < grid.cells.size(); ++c)
    if (element_ids[c] != 0) add_cell(shapes, c, grid.cells.kinds[c], grid.cells[c], file);
  return shapes;
}

/// Adds elements with point indices; number_nodes() replaces them by node indices.
void add_elements(SourcedMesh& into, const std::vector<SurfaceElement>& faces, const std::vector<std::uint32_t>& cells,
                  const std::vector<std::uint32_t>& ids, const std::vector<std::uint32_t>& parts, bool is_solid) {
  for (const SurfaceElement& face : faces) {
    const std::uint32_t cell = cells[face.source];
    into.mesh.elements.push_back(face.nodes);
    into.mesh.element_ids.push_back(ids[cell]);
    into.mesh.element_parts.push_back(parts[cell]);
    into.element_source.push_back(cell);
    into.element_is_solid.push_back(is_solid ? 1 : 0);
  }
}

std::vector<SurfaceElement> sorted(std::vector<SurfaceElement> faces, const std::vector<std::uint32_t>& cells,
                                   const std::vector<std::uint32_t>& ids) {
  std::stable_sort(faces.begin(), faces.end(),
                   [&](const auto& a, const auto& b) { return ids[cells[a.source]] < ids[cells[b.source]]; });
  return faces;
}

void number_nodes(SourcedMesh& into, const Grid& grid, const std::vector<std::uint32_t>& ids, const std::string& file) {
  std::vector<std::uint32_t> place(grid.points(), 0);
  for (const Quad& element : into.mesh.elements)
    for (const std::uint32_t point : element) place[point] = 1;
  for (std::uint32_t point = 0; point < place.size(); ++point)
    if (place[point] == 1) into.node_source.push_back(point);
  std::stable_sort(into.node_source.begin(), into.node_source.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; });
  for (std::uint32_t node = 0; node < into.node_source.size(); ++node) {
    const std::uint32_t point = into.node_source[node];
    if (node > 0 && into.mesh.node_ids.back() == ids[point])
      throw Error{Status::bad_input, file + ": node id " + std::to_string(ids[point]) +
                                         " belongs to two points of the surface; give every node its own id"};
    place[point] = node;
    into.mesh.node_ids.push_back(ids[point]);
    into.mesh.positions.insert(into.mesh.positions.end(),
                               {grid.positions[3 * std::size_t{point}], grid.positions[3 * std::size_t{point} + 1],
                                grid.positions[3 * std::size_t{point} + 2]});
  }
  for (Quad& element : into.mesh.elements)
    for (std::uint32_t& corner : element) corner = place[corner];
}

bool is_number_or_flag(const std::string& name) {
  const auto is_name = [&](const char* known) { return find_array({Array{name, 1, {}}}, known) != nullptr; };
  return std::any_of(node_id_names.begin(), node_id_names.end(), is_name) ||
         std::any_of(element_id_names.begin(), element_id_names.end(), is_name) ||
         std::any_of(part_id_names.begin(), part_id_names.end(), is_name) ||
         std::any_of(alive_names.begin(), alive_names.end(), is_name);
}

/// The name in lower case, without the prefix of OpenRadioss and the last `suffix` letters.
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
  fields.push_back({{name, unit_of(name), {}}, {}, {}, {}});
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

const Array* node_ids_of(const Grid& grid) { return find_any(grid.point_arrays, node_id_names); }

SourcedMesh mesh_of(const Grid& grid, const std::string& file) {
  const auto node_ids = ids_of(grid.point_arrays, node_id_names, grid.points(), file);
  const auto element_ids = ids_of(grid.cell_arrays, element_id_names, grid.cells.size(), file);
  auto parts = find_any(grid.cell_arrays, part_id_names) != nullptr
                   ? ids_of(grid.cell_arrays, part_id_names, grid.cells.size(), file)
                   : std::vector<std::uint32_t>(grid.cells.size(), 1);
  const Shapes shapes = shapes_of(grid, element_ids, file);
  SourcedMesh sourced;
  const SolidFaces solids = solid_faces(shapes.solids);
  add_elements(sourced, sorted(shell_faces(shapes.flats), shapes.flat_cells, element_ids), shapes.flat_cells,
               element_ids, parts, false);
  add_elements(sourced, sorted(solids.outer, shapes.solid_cells, element_ids), shapes.solid_cells, element_ids, parts,
               true);
  if (sourced.mesh.elements.empty())
    throw Error{Status::unsupported_input,
                file + ": has points, but no surface (no triangle, quad or solid with an area); give a mesh"};
  if (find_any(grid.cell_arrays, alive_names) != nullptr) {
    add_elements(sourced, solids.touching, shapes.solid_cells, element_ids, parts, true);
    sourced.mesh.touching = solids.touching.size();
  }
  number_nodes(sourced, grid, node_ids, file);
  sourced.mesh.has_solver_ids = node_ids_of(grid) != nullptr;
  return sourced;
}

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
  for (FieldSource& field : fields)
    for (const std::string& array : std::set{field.flat_array, field.solid_array, field.point_array})
      if (!array.empty()) field.field.source += (field.field.source.empty() ? "array " : ", ") + array;
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

bool has_alive_flags(const Grid& grid) { return find_any(grid.cell_arrays, alive_names) != nullptr; }

std::vector<std::uint8_t> alive_elements(const Grid& grid, const SourcedMesh& sourced, const std::string& file) {
  std::vector<std::uint8_t> alive(sourced.mesh.elements.size(), 1);
  const Array* const flags = find_any(grid.cell_arrays, alive_names);
  for (std::size_t e = 0; flags != nullptr && e < alive.size(); ++e) {
    const double flag = flags->values[sourced.element_source[e]];
    if (std::isnan(flag))
      throw Error{Status::bad_input, file + ": \"" + flags->name + "\" of element " +
                                         std::to_string(sourced.mesh.element_ids[e]) +
                                         " is not a number; export 0 for eroded elements, 1 for others"};
    alive[e] = flag != 0 ? 1 : 0;
  }
  return alive;
}
}  // namespace lbea::io::grid
