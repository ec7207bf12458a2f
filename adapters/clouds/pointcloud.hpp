// Point clouds in files: PLY, PCD, STL, and text with a point per line (.xyz, .txt, .csv, .asc).
#pragma once

#include <lbea/lbea.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lbea::io {

struct PointCloud {
  std::vector<Point> points;             // as in the file, points that are not finite included
  std::optional<std::int64_t> stamp_ns;  // from a comment "... stamp_ns 1000050 ..."
  std::string source;                    // the file's name
};

/// Reads a file; its kind is told from its content, not from its name.
/// Throws Error{file_not_found | bad_input | unsupported_input} that names file and line or byte.
[[nodiscard]] PointCloud read_point_cloud(const std::filesystem::path& path);

/// The same for bytes in memory; `name` stands for the file in messages.
[[nodiscard]] PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name);

/// PLY, ASCII or binary of either byte order. Takes the properties x, y, z of the element "vertex", whatever
/// their scalar type, and skips all else. Throws Error{bad_input | unsupported_input}.
[[nodiscard]] PointCloud parse_ply(std::span<const std::byte> bytes, const std::string& name);

/// PCD, as text, binary or packed (LZF); of the fields only x, y, z. In organised clouds (HEIGHT above 1) pixels
/// without a point, NaN or 0 0 0, become NaN. Throws Error{bad_input | unsupported_input}.
[[nodiscard]] PointCloud parse_pcd(std::span<const std::byte> bytes, const std::string& name);

/// The corners of an STL file's triangles, each position once, in the order of the file. Throws Error{bad_input}.
[[nodiscard]] PointCloud parse_stl_cloud(std::span<const std::byte> bytes, const std::string& name);

/// Points at the origin become NaN: pixels of an organised cloud that hold no point.
void mark_empty_pixels(std::vector<Point>& points) noexcept;

/// A table of the formats for people, a line each.
[[nodiscard]] std::string list_cloud_formats();

/// Text, a point per line. Columns are separated by blanks, tabs, commas or semicolons (with the latter, and with
/// tabs, a comma may be the decimal sign). A line of names, which may be a comment, tells the columns x, y, z;
/// without it they are the first three that hold numbers. Empty fields and "nan" give NaN. Lines that begin with
/// #, % or // are comments. Throws Error{bad_input}.
[[nodiscard]] PointCloud parse_xyz(std::span<const std::byte> bytes, const std::string& name);

/// Writes binary little-endian PLY with float x, y, z and a header line per comment.
/// Throws Error{write_failed}, or Error{bad_config} for a comment with a line break.
void write_ply(const std::filesystem::path& path, std::span<const Point> points, std::span<const std::string> comments);

}  // namespace lbea::io
