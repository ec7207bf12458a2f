// The description of a bake: ensemble.toml and the two tables it refers to.
#pragma once

#include "precompute/ensemble.hpp"

#include <optional>

namespace lbea::io {
/// Reads ensemble.toml; every key is described in ENSEMBLE.md beside this file. Paths in it are relative to its
/// folder and are returned resolved, with patterns expanded and sorted by name.
/// Throws Error{file_not_found | bad_input} that names file, line and key.
[[nodiscard]] bake::EnsembleDescription read_ensemble_toml(const std::filesystem::path& path);

/// The paths in `folder` that `pattern` (with * ? []) matches, in the order of their names. A pattern without these
/// characters matches the path of its own name, when that exists.
[[nodiscard]] std::vector<std::filesystem::path> matching_paths(const std::filesystem::path& folder,
                                                                const std::string& pattern);

/// Whether `name` (a path below `folder`, a run's name, or a pattern of either) refers to `run`.
[[nodiscard]] bool means_run(const std::string& name, const std::filesystem::path& folder,
                             const std::filesystem::path& run);

/// What was varied between the runs.
struct ParameterTable {
  std::vector<std::string> names, units;  // "t_front [mm]" is name "t_front", unit "mm"; no brackets: unit ""
  std::vector<std::string> runs;          // names of the rows
  std::vector<double> values;             // runs x names; NaN: not given

  /// The row of a run; nothing when the table has none.
  [[nodiscard]] std::optional<std::span<const double>> row(std::string_view run) const;
};

/// Reads a table separated by commas, semicolons or tabs (with the latter two, a comma may be the decimal sign):
/// a line of names, then a line per run that begins with the run's name. Empty fields, "nan" and "NA" are missing.
/// Throws Error{file_not_found | bad_input} that names file, line and column.
[[nodiscard]] ParameterTable read_parameters_csv(const std::filesystem::path& path);

/// Reads node ids in the solver's numbering, separated by blanks, commas, semicolons or lines; # begins a comment.
/// Throws Error{file_not_found | bad_input} that names file and line.
[[nodiscard]] std::vector<std::uint32_t> read_node_ids(const std::filesystem::path& path);
}  // namespace lbea::io
