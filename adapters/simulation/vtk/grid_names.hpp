// The names by which arrays in mesh files are known to be ids and flags; letters' case does not count.
#pragma once

#include <array>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

inline constexpr std::array node_id_names{"NODE_ID", "NodeID", "GlobalNodeId"};
inline constexpr std::array element_id_names{"ELEMENT_ID", "ElementID", "GlobalElementId"};
inline constexpr std::array part_id_names{"PART_ID", "PartID", "part"};
inline constexpr std::array alive_names{"EROSION_STATUS", "alive"};

/// The first of these with one component; nullptr when there is none.
template <typename Names>
[[nodiscard]] const Array* find_any(const std::vector<Array>& arrays, const Names& names) {
  for (const char* name : names)
    if (const Array* array = find_array(arrays, name); array != nullptr && array->components == 1) return array;
  return nullptr;
}

}  // namespace lbea::io::grid
