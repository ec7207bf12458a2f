// Meshes in STL files: triangles, each with corners of its own, in text or binary.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

/// Binary when the number of triangles fits the file's size, whatever the file begins with; else text when it begins
/// with "solid" and has a "facet".
[[nodiscard]] bool is_stl(const std::filesystem::path& file, std::string_view start);

/// A triangle soup. Throws Error{bad_input} with line or byte.
[[nodiscard]] Grid parse_stl(std::string_view bytes, const std::string& name);
[[nodiscard]] Grid read_stl(const std::filesystem::path& file);

}  // namespace lbea::io::grid
