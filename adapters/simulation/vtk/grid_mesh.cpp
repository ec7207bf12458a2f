#include "adapters/simulation/vtk/grid_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "adapters/simulation/d3plot/d3plot_surface.hpp"
#include "adapters/simulation/vtk/grid_names.hpp"

namespace lbea::io::grid {
namespace {

using d3plot::Hexahedron;
using d3plot::Quad;
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

/// What the cells come down to: quads and solids with the cells they are.
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
  switch (kind) {
    case CellKind::vertex:
    case CellKind::poly_vertex:
    case CellKind::line:
    case CellKind::poly_line:
    case CellKind::quadratic_line:
      return;
    case CellKind::triangle:
    case CellKind::quadratic_triangle:
      return shapes.add_flat(cell, {p[0], p[1], p[2], p[2]});
    case CellKind::quad:
    case CellKind::quadratic_quad:
    case CellKind::biquadratic_quad:
      return shapes.add_flat(cell, {p[0], p[1], p[2], p[3]});
    case CellKind::pixel:
      return shapes.add_flat(cell, {p[0], p[1], p[3], p[2]});
    case CellKind::polygon:
      return add_fan(shapes, cell, p);
    case CellKind::triangle_strip:
      return add_strip(shapes, cell, p);
    case CellKind::tetrahedron:
    case CellKind::quadratic_tetrahedron:
      return shapes.add_solid(cell, {p[0], p[1], p[2], p[3], p[3], p[3], p[3], p[3]});
    case CellKind::voxel:
      return shapes.add_solid(cell, {p[0], p[1], p[3], p[2], p[4], p[5], p[7], p[6]});
    case CellKind::hexahedron:
    case CellKind::quadratic_hexahedron:
    case CellKind::triquadratic_hexahedron:
      return shapes.add_solid(cell, {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]});
    case CellKind::wedge:
    case CellKind::quadratic_wedge:
      return shapes.add_solid(cell, {p[0], p[1], p[2], p[2], p[3], p[4], p[5], p[5]});
    case CellKind::pyramid:
    case CellKind::quadratic_pyramid:
      return shapes.add_solid(cell, {p[0], p[1], p[2], p[3], p[4], p[4], p[4], p[4]});
  }
  throw Error{Status::unsupported_input, file + ", cell " + std::to_string(cell) + ": cells of VTK's kind " +
                                             std::to_string(static_cast<int>(kind)) +
                                             " are not read; convert the mesh to triangles and quads"};
}

Shapes shapes_of(const Grid& grid, const std::vector<std::uint32_t>& element_ids, const std::string& file) {
  Shapes shapes;
  for (std::uint32_t c = 0; c < grid.cells.size(); ++c)
    if (element_ids[c] != 0) add_cell(shapes, c, grid.cells.kinds[c], grid.cells[c], file);
  return shapes;
}

/// Corners in the file's points, to be numbered by nodes later.
void add_elements(SourcedMesh& into, std::vector<d3plot::SurfaceElement> faces, const std::vector<std::uint32_t>& cells,
                  const std::vector<std::uint32_t>& ids, const std::vector<std::uint32_t>& parts, bool is_solid) {
  std::stable_sort(faces.begin(), faces.end(),
                   [&](const auto& a, const auto& b) { return ids[cells[a.source]] < ids[cells[b.source]]; });
  for (const d3plot::SurfaceElement& face : faces) {
    const std::uint32_t cell = cells[face.source];
    into.mesh.elements.push_back(face.nodes);
    into.mesh.element_ids.push_back(ids[cell]);
    into.mesh.element_parts.push_back(parts[cell]);
    into.element_source.push_back(cell);
    into.element_is_solid.push_back(is_solid ? 1 : 0);
  }
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
                                         " stands at two points of the surface; give every node its own id"};
    place[point] = node;
    into.mesh.node_ids.push_back(ids[point]);
    into.mesh.positions.insert(into.mesh.positions.end(),
                               {grid.positions[3 * std::size_t{point}], grid.positions[3 * std::size_t{point} + 1],
                                grid.positions[3 * std::size_t{point} + 2]});
  }
  for (Quad& element : into.mesh.elements)
    for (std::uint32_t& corner : element) corner = place[corner];
}

}  // namespace

SourcedMesh mesh_of(const Grid& grid, const std::string& file) {
  const auto node_ids = ids_of(grid.point_arrays, node_id_names, grid.points(), file);
  const auto element_ids = ids_of(grid.cell_arrays, element_id_names, grid.cells.size(), file);
  auto parts = find_any(grid.cell_arrays, part_id_names) != nullptr
                   ? ids_of(grid.cell_arrays, part_id_names, grid.cells.size(), file)
                   : std::vector<std::uint32_t>(grid.cells.size(), 1);
  const Shapes shapes = shapes_of(grid, element_ids, file);
  SourcedMesh sourced;
  add_elements(sourced, d3plot::shell_faces(shapes.flats), shapes.flat_cells, element_ids, parts, false);
  add_elements(sourced, d3plot::outer_faces(shapes.solids), shapes.solid_cells, element_ids, parts, true);
  if (sourced.mesh.elements.empty())
    throw Error{Status::unsupported_input,
                file + ": has points, but no surface (no triangle, quad or solid with an area); give a mesh"};
  number_nodes(sourced, grid, node_ids, file);
  return sourced;
}

}  // namespace lbea::io::grid
