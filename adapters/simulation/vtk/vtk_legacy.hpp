// VTK's older files ("# vtk DataFile Version"), text or binary, with an unstructured grid or polygons.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_vtk_legacy(std::string_view start) noexcept;

/// Versions 1 to 5, with cells as lists or as offsets and connectivity. Throws Error{bad_input | unsupported_input}
/// that names file and byte.
[[nodiscard]] Grid parse_vtk_legacy(std::string_view bytes, const std::string& name);

[[nodiscard]] Grid read_vtk_legacy(const std::filesystem::path& file);
/// Nothing but its time, without reading what follows.
[[nodiscard]] Grid read_vtk_legacy_time(const std::filesystem::path& file);

}  // namespace lbea::io::grid
