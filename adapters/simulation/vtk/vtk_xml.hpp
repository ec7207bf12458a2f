// VTK's XML files with an unstructured grid (.vtu) or polygons (.vtp), in every encoding that VTK and ParaView write.
#pragma once

#include <string_view>

#include "adapters/simulation/vtk/grid.hpp"

namespace lbea::io::grid {

[[nodiscard]] bool is_vtk_xml(std::string_view start) noexcept;

/// Several pieces are read as one grid. The time is the field "TimeValue". Throws Error{bad_input | unsupported_input};
/// unsupported are LZMA, other kinds of data sets, and parallel files, which only name others.
[[nodiscard]] Grid parse_vtk_xml(std::string_view bytes, const std::string& name);

[[nodiscard]] Grid read_vtk_xml(const std::filesystem::path& file);
/// Nothing but its time.
[[nodiscard]] Grid read_vtk_xml_time(const std::filesystem::path& file);

}  // namespace lbea::io::grid
