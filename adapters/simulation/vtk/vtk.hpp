// The three kinds of VTK files: legacy (.vtk), XML (.vtu, .vtp), and ParaView's collections of the latter (.pvd).
#pragma once

#include "adapters/simulation/grid/grid_reader.hpp"

namespace lbea::io::grid {
[[nodiscard]] bool is_vtk_legacy(std::string_view start) noexcept;
[[nodiscard]] bool is_vtk_xml(std::string_view start) noexcept;
[[nodiscard]] bool is_vtk_collection(std::string_view start) noexcept;

/// Unstructured grid or polygons, text or binary, versions 1 to 5 (cells as lists, or as offsets and connectivity).
/// Throws Error{bad_input | unsupported_input} that names file and byte.
[[nodiscard]] Grid parse_vtk_legacy(std::string_view bytes, const std::string& name);

/// Unstructured grid or polygons in every encoding that VTK and ParaView write. Several pieces become one grid; the
/// time is the field "TimeValue". Throws Error{bad_input | unsupported_input}: unsupported are LZMA, other kinds of
/// data sets, and parallel files, which only name other files.
[[nodiscard]] Grid parse_vtk_xml(std::string_view bytes, const std::string& name);

/// A grid that has only its time.
[[nodiscard]] Grid read_vtk_legacy_time(const std::filesystem::path& file);
[[nodiscard]] Grid read_vtk_xml_time(const std::filesystem::path& file);

/// The files of a collection, sorted by time; relative names are resolved against its folder.
/// Throws Error{file_not_found | bad_input | unsupported_input}; unsupported are several files at one time.
[[nodiscard]] std::vector<GridState> read_vtk_collection(const std::filesystem::path& file);
}  // namespace lbea::io::grid
