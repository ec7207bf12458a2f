// LS-DYNA keyword files.
#pragma once

#include "adapters/simulation/grid/grid.hpp"

namespace lbea::io::keyword {
[[nodiscard]] bool is_keyword(std::string_view start) noexcept;

/// *NODE, *ELEMENT_SHELL, *ELEMENT_SOLID and *ELEMENT_TSHELL in fixed columns (8 and 16 wide, I10, LONG=Y) or with
/// commas, also in the files named by *INCLUDE and *INCLUDE_TRANSFORM. Other keywords are skipped. Shells may have the
/// options THICKNESS, BETA, MCID, OFFSET and DOF; solids take one card or two, and tetrahedra may have ten nodes.
/// `name`: the path of the file. Throws Error{file_not_found | bad_input | unsupported_input} that names file and line.
[[nodiscard]] grid::Grid parse_keyword(std::string_view text, const std::string& name);

/// The included files.
[[nodiscard]] std::vector<std::filesystem::path> list_keyword_includes(const std::filesystem::path& file);
}  // namespace lbea::io::keyword
