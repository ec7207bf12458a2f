// Point clouds in files: PLY, PCD, STL, and text with a point per line (.xyz, .txt, .csv, .asc).
#pragma once

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::io {

struct PointCloud {
  std::vector<Point> points;             // as in the file, including points that are not finite; no empty pixels
  std::optional<std::int64_t> stamp_ns;  // from a comment "... stamp_ns 1000050 ..."
  std::string source;                    // the file's name
};

/// Reads a file; its format is recognized by its content, not by its name. `columns`: which columns of a text are the
/// coordinates, by their names, e.g. "X,Y,Z" or, with displacements, "X+U,Y+V,Z+W"; empty: those named x, y, z.
/// Throws Error{file_not_found | bad_input | unsupported_input} that names file and line or byte.
[[nodiscard]] PointCloud read_point_cloud(const std::filesystem::path& path, const std::string& columns = {});

/// The same for bytes in memory; messages call them `name`.
[[nodiscard]] PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name);

/// What a file's name says. Text may also be a table about the clouds beside it.
enum class CloudName : std::uint8_t { none, text, cloud };
[[nodiscard]] CloudName cloud_name(const std::filesystem::path& file);
/// The extensions of all formats, separated by blanks.
[[nodiscard]] std::string cloud_extensions();

/// Text with named columns, see read_point_cloud().
[[nodiscard]] PointCloud parse_text_cloud(std::span<const std::byte> bytes, const std::string& name,
                                          std::string_view columns);

/// The reader of one format; see the table in formats.cpp. Throws Error{bad_input | unsupported_input}.
using ParseCloud = PointCloud(std::span<const std::byte> bytes, const std::string& name);

/// A table of the formats for --list-formats, a line each.
[[nodiscard]] std::string list_cloud_formats();

/// Writes binary little-endian PLY with float x, y, z and a header line per comment.
/// Throws Error{write_failed}, or Error{bad_config} for a comment with a line break.
void write_ply(const std::filesystem::path& path, std::span<const Point> points, std::span<const std::string> comments);

}  // namespace lbea::io
