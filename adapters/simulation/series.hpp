// Files of one run that differ in a number at the end of their names: R004A001.vtk, R004A007.vtk, ...
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lbea::io {

/// All files beside `file` whose names differ from its name only in the number before the extension, sorted by it;
/// `file` alone when it has no number. Throws Error{file_not_found} when it does not exist.
[[nodiscard]] std::vector<std::filesystem::path> find_series(const std::filesystem::path& file);

/// The same for all files of a series, another one for every other series; empty for other files and for folders.
[[nodiscard]] std::string series_name(const std::filesystem::path& file);

/// The first file of every series in a folder, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> first_files(const std::filesystem::path& folder);

}  // namespace lbea::io
