// Clouds named on a command line.
#pragma once

#include "tools/shared/cli/command_line.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace lbea::tool {

/// Files as given; a folder means the clouds in it by their extensions, sorted by name.
/// Throws Error{file_not_found} for a missing path and for a folder without clouds.
[[nodiscard]] std::vector<std::filesystem::path> find_clouds(const std::vector<std::string>& paths);

/// --columns: the argument of io::read_point_cloud().
void add_columns_option(CommandLine& app, std::string& columns);

}  // namespace lbea::tool
