// Meshes in LS-DYNA's keyword files: *NODE, *ELEMENT_SHELL, *ELEMENT_SOLID.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_keyword(std::string_view start) noexcept;

/// Fixed columns (8 and 16 wide, I10, LONG=Y) or commas. Other keywords are passed over, *INCLUDE too. Shells may carry
/// the options THICKNESS, BETA, MCID, OFFSET and DOF; solids one card or two. Throws Error{bad_input |
/// unsupported_input} with the line.
[[nodiscard]] Grid parse_keyword(std::string_view text, const std::string& name);
[[nodiscard]] Grid read_keyword(const std::filesystem::path& file);

}  // namespace lbea::io::grid
