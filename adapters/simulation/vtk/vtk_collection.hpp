// ParaView's collections (.pvd): which file is the run at which time.
#pragma once

#include <string_view>
#include <vector>

#include "adapters/simulation/vtk/grid_reader.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_vtk_collection(std::string_view start) noexcept;

/// Files by time, with paths that hold from here. Throws Error{bad_input | unsupported_input | file_not_found};
/// unsupported are several parts at one time.
[[nodiscard]] std::vector<GridState> read_vtk_collection(const std::filesystem::path& file);

}  // namespace lbea::io::grid
