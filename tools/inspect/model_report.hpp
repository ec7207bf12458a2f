// Prints the contents of a model file, or the differences of two.
#pragma once

#include <filesystem>

namespace lbea::tool {

/// Both verify the whole file first and throw the error of Model::open when it is damaged.
void print_model(const std::filesystem::path& file);
void print_model_json(const std::filesystem::path& file);

/// Runs that were added, withdrawn or changed, and changed sizes, settings and sections. Both verify both files and
/// throw the error of Model::open when one is damaged.
void print_diff(const std::filesystem::path& before, const std::filesystem::path& after);
void print_diff_json(const std::filesystem::path& before, const std::filesystem::path& after);

}  // namespace lbea::tool
