// What an evaluation leaves behind: tables for people, JSON and CSV for programs and figures.
#pragma once

#include "tools/eval/evaluation.hpp"

#include <filesystem>
#include <string>

namespace lbea::tool {

/// All tables, as Markdown.
[[nodiscard]] std::string tables(const Evaluation& evaluation);

[[nodiscard]] std::string to_json(const Evaluation& evaluation);

/// FOLDER/tables.md, summary.json, frames.csv (a line per frame and round), view.csv (a line per sample and per
/// undisturbed unseen frame). Throws Error{write_failed}.
void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation);

}  // namespace lbea::tool
