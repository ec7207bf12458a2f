// Measurements as text, Markdown, JSON and CSV.
#pragma once

#include "tools/bench/measurement.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace lbea::tool::bench {

struct Report {
  std::vector<std::pair<std::string, std::string>> facts;  // circumstances, model, clouds, what was checked
  std::vector<BenchCloud> clouds;
  std::vector<Measurement> measurements;  // the product first, then the baselines
};

enum class TableStyle { plain, markdown };

[[nodiscard]] std::string to_text(const Report& report, TableStyle style);
[[nodiscard]] std::string to_json(const Report& report);
/// Every timed frame, a row each. Throws Error{write_failed}.
void write_csv(const std::filesystem::path& file, const Report& report);

}  // namespace lbea::tool::bench
