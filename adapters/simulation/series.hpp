// Files of one run that differ in a number at the end of their names: R004A001.vtk, R004A007.vtk, ...
#pragma once

#include <filesystem>
#include <vector>

namespace lbea::io {

/// All files beside `file` whose names differ from its name in nothing but the number before the extension, by number;
/// `file` alone when it has no number. Throws Error{file_not_found} when it is not there.
[[nodiscard]] std::vector<std::filesystem::path> find_series(const std::filesystem::path& file);

/// The first file of every series in a folder, by name.
[[nodiscard]] std::vector<std::filesystem::path> first_files(const std::filesystem::path& folder);

}  // namespace lbea::io
