// Measurements as text, Markdown, JSON and CSV, with the conditions under which they were made.
#pragma once

#include "tools/bench/measurement.hpp"

namespace lbea::tool::bench {

struct Report {
  std::vector<std::pair<std::string, std::string>> facts;  // conditions, model, clouds, what was checked
  std::vector<BenchCloud> clouds;
  std::vector<Measurement> measurements;  // the product first, then the baselines
};

enum class TableStyle { plain, markdown };

[[nodiscard]] std::string to_text(const Report& report, TableStyle style);
[[nodiscard]] std::string to_json(const Report& report);
/// One row per timed frame. Throws Error{write_failed}.
void write_csv(const std::filesystem::path& file, const Report& report);

/// Named facts in the order in which they are printed: machine, cores, load, commit, compiler, flags, kernels, date.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> conditions();

}  // namespace lbea::tool::bench
