// The ensemble to bake: the description in the TOML file, with the changes made by flags.
#pragma once

#include "precompute/ensemble.hpp"
#include "tools/shared/cli/tool.hpp"

#include <optional>

namespace lbea::tool {

struct BakeCommand {
  std::filesystem::path toml, output, earlier;
  unsigned threads = 0;
  bool json = false, leave_out_broken = false;

  // Each overrides the TOML file or the default.
  std::vector<std::filesystem::path> runs;
  std::optional<std::string> reference_run, mode, steps, length_unit;
  std::optional<std::uint32_t> impact_step, modes;
  std::vector<std::uint32_t> region_parts;
  std::vector<double> region_box;
  std::optional<std::filesystem::path> region_nodes, sensor, parameters;
  std::vector<std::filesystem::path> views;
  std::vector<std::string> fields;
  std::optional<double> time_factor, envelope_margin;
  std::optional<bool> correspondence, compact_fields, landmarks;
};

/// `command` must outlive the parsing. A command line without runs or without a model ends with exit_usage.
void declare(Tool& tool, BakeCommand& command);

/// "all", "N", "FIRST:LAST", "FIRST:LAST:STRIDE" (last included) or "N,N,..."; nothing for any other text.
[[nodiscard]] std::optional<bake::StepSelection> parse_step_selection(const std::string& text);

/// The description to bake. Throws Error{bad_config | bad_input | file_not_found}.
[[nodiscard]] bake::EnsembleDescription described(const BakeCommand& command);

}  // namespace lbea::tool
