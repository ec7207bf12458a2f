// From the points and cells of a file to the surface mesh of a run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "adapters/simulation/vtk/grid.hpp"
#include "precompute/simulation.hpp"

namespace lbea::io::grid {

/// A mesh, and where in the file its nodes and elements are.
struct SourcedMesh {
  bake::SimulationMesh mesh;
  std::vector<std::uint32_t> node_source;      // node -> point
  std::vector<std::uint32_t> element_source;   // element -> cell
  std::vector<std::uint8_t> element_is_solid;  // elements; 1: a face of a solid
};

/// Flat cells and the faces that belong to exactly one solid, flat ones first; only points that these use, in the order
/// of their ids. Ids come from the arrays NODE_ID, ELEMENT_ID, PART_ID (and other spellings, see grid_names.hpp), else
/// they count from 1. Cells with element id 0 are drawings, not part of the model. Points, lines and flat cells that
/// repeated nodes leave without area are left out; polygons with more than four corners become triangles. Throws
/// Error{bad_input | unsupported_input} when there is no surface, an id stands twice or a kind of cell is unknown.
[[nodiscard]] SourcedMesh mesh_of(const Grid& grid, const std::string& file);

}  // namespace lbea::io::grid
