// What is inside a model file, for people and for programs.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>

namespace lbea::tool {

/// All of it but the large arrays. Verifies the whole file first.
[[nodiscard]] nlohmann::ordered_json model_report(const std::filesystem::path& file);

/// Both verify the whole file first and throw the error of Model::open when it is damaged.
void print_model(const std::filesystem::path& file);
void print_model_json(const std::filesystem::path& file);

}  // namespace lbea::tool
