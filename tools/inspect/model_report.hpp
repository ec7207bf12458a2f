// What is inside a model file, for people and for programs.
#pragma once

#include <filesystem>

namespace lbea {

/// Both verify the whole file first and throw the error of Model::open when it is damaged.
void print_model(const std::filesystem::path& file);
void print_model_json(const std::filesystem::path& file);

}  // namespace lbea
