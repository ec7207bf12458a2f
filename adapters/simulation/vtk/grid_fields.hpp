// From the arrays of a mesh file to the fields of a run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "adapters/simulation/vtk/grid_mesh.hpp"

namespace lbea::io::grid {

/// A field of the run and the arrays it is read from.
struct FieldSource {
  bake::SimulationField field;
  std::string flat_array, solid_array, point_array;  // names; empty: 0 for elements of that kind
};

/// One field per array with one component that is neither an id nor a flag. Names are in small letters, without the
/// prefixes 2DELEM_ and 3DELEM_ (of OpenRadioss: shells and solids) and, with `suffix`, without that ending; arrays
/// without it are left out. A point array becomes the mean over the element's corners.
[[nodiscard]] std::vector<FieldSource> fields_of(const Grid& grid, const std::string& suffix);

/// The field's value per element of `mesh`; 0 where the file has none or none that is finite.
[[nodiscard]] std::vector<float> field_values(const Grid& grid, const SourcedMesh& mesh, const FieldSource& source,
                                              const std::string& suffix);

/// 0 for eroded elements: those whose EROSION_STATUS (OpenRadioss) or "alive" is 0. All 1 without such an array.
[[nodiscard]] std::vector<std::uint8_t> alive_elements(const Grid& grid, const SourcedMesh& mesh);

}  // namespace lbea::io::grid
