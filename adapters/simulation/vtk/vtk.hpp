// The kinds of VTK files: legacy (.vtk), XML (.vtu, .vtp), parallel XML, which names pieces (.pvtu, .pvtp), and
// ParaView's collections of both XML kinds (.pvd).
#pragma once

#include "adapters/simulation/grid/grid_reader.hpp"

namespace lbea::io::grid {
[[nodiscard]] bool is_vtk_legacy(std::string_view start) noexcept;
[[nodiscard]] bool is_vtk_xml(std::string_view start) noexcept;
[[nodiscard]] bool is_vtk_parallel(std::string_view start) noexcept;
[[nodiscard]] bool is_vtk_collection(std::string_view start) noexcept;

/// Unstructured grid or polygons, text or binary, versions 1 to 5 (cells as lists, or as offsets and connectivity).
/// Throws Error{bad_input | unsupported_input} that names file and byte.
[[nodiscard]] Grid parse_vtk_legacy(std::string_view bytes, const std::string& name);

/// Unstructured grid or polygons in every encoding that VTK and ParaView write. Several pieces become one grid; the
/// time is the field "TimeValue". Throws Error{bad_input | unsupported_input}: unsupported are LZMA and other kinds of
/// data sets.
[[nodiscard]] Grid parse_vtk_xml(std::string_view bytes, const std::string& name);

/// The pieces that a parallel file names, as one grid without their ghost cells; `name` is its path. The time is the
/// file's own or the first piece's. Throws Error{file_not_found | bad_input | unsupported_input}.
[[nodiscard]] Grid parse_vtk_parallel(std::string_view bytes, const std::string& name);
/// The pieces of a parallel file; none of another one.
[[nodiscard]] std::vector<std::filesystem::path> list_vtk_pieces(const std::filesystem::path& file);

/// A grid that has only its time.
[[nodiscard]] Grid read_vtk_legacy_time(const std::filesystem::path& file);
[[nodiscard]] Grid read_vtk_xml_time(const std::filesystem::path& file);
[[nodiscard]] Grid read_vtk_parallel_time(const std::filesystem::path& file);

/// A file of either XML kind, as collections name them.
[[nodiscard]] Grid read_vtk_member(const std::filesystem::path& file);

/// The files of a collection, sorted by time; relative names are resolved against its folder.
/// Throws Error{file_not_found | bad_input | unsupported_input}; unsupported are several files at one time.
[[nodiscard]] std::vector<GridState> read_vtk_collection(const std::filesystem::path& file);
}  // namespace lbea::io::grid
