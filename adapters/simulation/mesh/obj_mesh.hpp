// Meshes in Wavefront OBJ files: the lines v and f.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_obj(std::string_view start) noexcept;

/// Faces by position, texture and normal ("f 1/2/3 ..."), also counted back from the last vertex. All other lines are
/// passed over. Throws Error{bad_input} with the line.
[[nodiscard]] Grid parse_obj(std::string_view text, const std::string& name);
[[nodiscard]] Grid read_obj(const std::filesystem::path& file);

}  // namespace lbea::io::grid
