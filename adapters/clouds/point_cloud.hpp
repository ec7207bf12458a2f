// Point clouds in files: PLY, PCD, STL, and text with a point per line (.xyz, .txt, .csv, .asc).
#pragma once

#include <lbea/lbea.hpp>

#include <map>
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

/// A stamp in a file's name without extension, in ns: a number with its unit ("cloud_1000050ns", "left-12.5ms",
/// "a_0.0125s"), seconds after a t ("frame_t0.0125", "t=3.5"), or a time since 1970 alone (10 digits, a point and a
/// fraction: s; 13 digits: ms; 16: us; 19: ns). Nothing for other numbers, such as frame numbers.
[[nodiscard]] std::optional<std::int64_t> stamp_in_name(std::string_view stem) noexcept;

/// Capture times of clouds by file name.
class CloudStamps {
 public:
  /// No table.
  CloudStamps() = default;
  /// A text table with a line of names: a column "file" (or filename, name, cloud) and one of the time with its unit at
  /// the end (stamp_ns, timestamp_us, time_ms, t_s, "time [s]"). Throws Error{file_not_found | bad_input} with the
  /// line.
  explicit CloudStamps(const std::filesystem::path& table);

  /// The table's stamp for this file name (with or without extension). Without a table: `in_file`, else the stamp in
  /// the name. Throws Error{bad_input} for a file that is not in the table.
  [[nodiscard]] std::optional<std::int64_t> of(const std::filesystem::path& file,
                                               std::optional<std::int64_t> in_file) const;

 private:
  std::map<std::string, std::int64_t> table_;
};

/// The name of the table that is read when it is in the folder of the clouds.
inline constexpr const char* stamp_table_name = "stamps.csv";
}  // namespace lbea::io
