// When a cloud was captured, where its file does not say so itself: in the file's name, or in a table beside it.
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
/// fraction: s; 13 digits: ms; 16: us; 19: ns). Nothing for other numbers: those of frames are no stamps.
[[nodiscard]] std::optional<std::int64_t> stamp_in_name(std::string_view stem) noexcept;

/// Stamps by the name of the file.
class CloudStamps {
 public:
  /// No table.
  CloudStamps() = default;
  /// A text table with a line of names: a column "file" (or filename, name, cloud) and one of the time with its unit at
  /// the end (stamp_ns, timestamp_us, time_ms, t_s, "time [s]"). Throws Error{file_not_found | bad_input} with the
  /// line.
  explicit CloudStamps(const std::filesystem::path& table);

  /// The table's for this file's name (with or without extension); without a table `in_file`, else the name's.
  /// Throws Error{bad_input} for a file that the table lacks.
  [[nodiscard]] std::optional<std::int64_t> of(const std::filesystem::path& file,
                                               std::optional<std::int64_t> in_file) const;

 private:
  std::map<std::string, std::int64_t> table_;
};

/// The name of a table that is read when it stands beside the clouds.
inline constexpr const char* stamp_table_name = "stamps.csv";

}  // namespace lbea::io
