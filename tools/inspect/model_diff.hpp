// What tells two models apart: runs that came, went or changed, sizes, settings, sections.
#pragma once

#include <filesystem>

namespace lbea::tool {

/// Both verify both files and throw the error of Model::open when one is damaged.
void print_diff(const std::filesystem::path& before, const std::filesystem::path& after);
void print_diff_json(const std::filesystem::path& before, const std::filesystem::path& after);

}  // namespace lbea::tool
