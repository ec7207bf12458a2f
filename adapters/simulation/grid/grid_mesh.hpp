// The surface mesh and the fields of a run, from the points, cells and arrays of a file.
#pragma once

#include "adapters/simulation/grid/grid.hpp"
#include "precompute/simulation.hpp"

namespace lbea::io::grid {

/// A mesh, and the points and cells of the file that its nodes and elements come from.
struct SourcedMesh {
  bake::SimulationMesh mesh;
  std::vector<std::uint32_t> node_source;      // node -> point
  std::vector<std::uint32_t> element_source;   // element -> cell
  std::vector<std::uint8_t> element_is_solid;  // elements; 1: a face of a solid
};

/// Flat cells, then the faces that belong to exactly one solid, then, when cells can be eroded, the faces by which two
/// solids touch; only points that these use, in the order of their ids. Ids come from the arrays NODE_ID, ELEMENT_ID,
/// PART_ID (and other spellings), else they count from 1. Cells with element id 0 are drawings, not part of the model.
/// Points, lines and flat cells that repeated nodes leave without area are left out; polygons with more than four
/// corners become triangles. Throws Error{bad_input | unsupported_input} when there is no surface, an id is used twice
/// or a kind of cell is unknown.
[[nodiscard]] SourcedMesh mesh_of(const Grid& grid, const std::string& file);

/// The array of node ids; nullptr when there is none.
[[nodiscard]] const Array* node_ids_of(const Grid& grid);

/// A field of the run and the arrays it is read from.
struct FieldSource {
  bake::SimulationField field;
  std::string flat_array, solid_array, point_array;  // names; empty: 0 for elements of that kind
};

/// One field per array with one component that is neither an id nor a flag. Names are in lower case, without the
/// prefixes 2DELEM_ and 3DELEM_ (of OpenRadioss: shells and solids) and, with `suffix`, without that ending; arrays
/// without it are left out. A point array becomes the mean over the element's corners.
[[nodiscard]] std::vector<FieldSource> fields_of(const Grid& grid, const std::string& suffix);

/// The field's value per element of `mesh`; 0 where the file has no value.
[[nodiscard]] std::vector<float> field_values(const Grid& grid, const SourcedMesh& mesh, const FieldSource& source,
                                              const std::string& suffix);

/// Whether the grid tells which elements are eroded.
[[nodiscard]] bool has_alive_flags(const Grid& grid);

/// 0 for eroded elements: those whose EROSION_STATUS (OpenRadioss) or "alive" is 0. All 1 without such an array.
/// Throws Error{bad_input} when a flag is not a number.
[[nodiscard]] std::vector<std::uint8_t> alive_elements(const Grid& grid, const SourcedMesh& mesh,
                                                       const std::string& file);

}  // namespace lbea::io::grid
