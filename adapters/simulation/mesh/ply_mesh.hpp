// Meshes in PLY files: the elements "vertex" and "face", text or binary.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_ply(std::string_view start) noexcept;

/// Values of vertices and faces beside coordinates and corners become arrays. Throws Error{bad_input |
/// unsupported_input} with line or byte.
[[nodiscard]] Grid parse_ply_mesh(std::string_view bytes, const std::string& name);
[[nodiscard]] Grid read_ply(const std::filesystem::path& file);

}  // namespace lbea::io::grid
