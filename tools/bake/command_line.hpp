// What to bake: the TOML file's description with the flags' changes.
#pragma once

#include "precompute/ensemble.hpp"
#include "tools/shared/cli/tool.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct BakeCommand {
  std::filesystem::path toml, output, earlier;
  unsigned threads = 0;
  bool json = false, leave_out_broken = false;

  // Each replaces what the TOML file or the default says.
  std::vector<std::filesystem::path> runs;
  std::optional<std::string> reference_run, mode, steps, length_unit;
  std::optional<std::uint32_t> impact_step, modes;
  std::vector<std::uint32_t> region_parts;
  std::vector<double> region_box;
  std::optional<std::filesystem::path> region_nodes, sensor, views, parameters;
  std::vector<std::string> fields;
  std::optional<double> time_factor, envelope_margin;
  std::optional<bool> correspondence, compact_fields, landmarks;
};

void declare(Tool& tool, BakeCommand& command);

/// "all", "N", "FIRST:LAST", "FIRST:LAST:STRIDE" (last included) or "N,N,..."; nothing when it is none of these.
[[nodiscard]] std::optional<bake::StepSelection> parse_step_selection(const std::string& text);

/// Throws Error{bad_config | bad_input | file_not_found}.
[[nodiscard]] bake::EnsembleDescription described(const BakeCommand& command);

}  // namespace lbea::tool
