// What a bake made, for people and for programs.
#pragma once

#include "precompute/bake.hpp"

#include <filesystem>

namespace lbea {

void print_table(const BakeSummary& summary, const std::filesystem::path& model);
void print_json(const BakeSummary& summary, const std::filesystem::path& model);

}  // namespace lbea
