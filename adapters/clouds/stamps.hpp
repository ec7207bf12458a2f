// Capture times of clouds, from a table, from the file, or from the file's name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace lbea::io {

/// A stamp in a file's name without extension, in ns: a number with its unit ("cloud_1000050ns", "left-12.5ms",
/// "a_0.0125s"), seconds after a t ("frame_t0.0125", "t=3.5"), or a time since 1970 alone (10 digits, a point and a
/// fraction: s; 13 digits: ms; 16: us; 19: ns). Nothing for other numbers, such as frame numbers.
[[nodiscard]] std::optional<std::int64_t> stamp_in_name(std::string_view stem) noexcept;

/// Stamps by file name.
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
