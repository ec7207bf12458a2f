#include "tools/bake/command_line.hpp"

#include "adapters/ensemble/ensemble_toml.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <sstream>

namespace lbea::tool {
namespace {

std::string check_steps(const std::string& text) {
  return parse_step_selection(text) ? "" : "'" + text + "' is not all, N, FIRST:LAST, FIRST:LAST:STRIDE or N,N,...";
}

/// Help text that names the default. For flags that override the TOML file and therefore have no default value.
template <typename T>
std::string with_default(const std::string& text, const T& value) {
  std::ostringstream stream;
  stream << text << " (default: " << value << ")";
  return stream.str();
}

void declare_region(Tool& tool, BakeCommand& command) {
  const char* region =
      "Region (nodes that meet all criteria; default: what the rigs of the views see at impact, else the whole mesh)";
  tool.add_option("--region-parts", command.region_parts, "part ids")->delimiter(',')->group(region)->default_text("");
  tool.add_option("--region-box", command.region_box, "x y z of the lower and of the upper corner, at impact")
      ->expected(6)
      ->group(region)
      ->default_text("");
  tool.add_option("--region-nodes", command.region_nodes, "text file of node ids")->group(region);
  tool.add_option("--sensor", command.sensor, "sensor.json: the nodes that this rig sees at impact")->group(region);
}

/// What the model contains beside the samples, and the units of the runs.
void declare_content(Tool& tool, BakeCommand& command) {
  const bake::EnsembleDescription defaults;
  tool.add_option("--fields", command.fields,
                  with_default("field quantities to store, all or none", defaults.fields.front()))
      ->delimiter(',')
      ->default_text("");
  tool.add_option(
      "--compact-fields", command.compact_fields,
      "store fields in 16 bits instead of 32 and report the rounding error: true or false (default: false)");
  tool.add_option("--parameters", command.parameters, "table of the parameters that vary between the runs");
  tool.add_option("--length-unit", command.length_unit,
                  with_default("unit of the runs' lengths", defaults.length_unit));
  tool.add_option("--time-factor", command.time_factor,
                  with_default("seconds per unit of the runs' times", defaults.time_factor));
  tool.add_option("--envelope-margin", command.envelope_margin,
                  "points farther than this from all samples are background, in the length unit (default: 25 mm)");
  tool.add_option("--correspondence", command.correspondence,
                  "store the data that VtP matching needs: true or false (default: true)");
  tool.add_option("--landmarks", command.landmarks,
                  "store the positions that matching needs in a section of their own, for models larger than memory: "
                  "true or false (default: when positions take more than 1 GiB)");
  tool.add_option("--views", command.views,
                  "sensor.json: render depth images of every sample as this rig sees it, for matching by fit (default: "
                  "--sensor); "
                  "repeatable, for several rigs around the component")
      ->repeatable();
}

template <typename T>
void replace(T& value, const std::optional<T>& by) {
  if (by) value = *by;
}

void replace_views(bake::EnsembleDescription& description, std::span<const std::filesystem::path> sensors) {
  if (sensors.empty()) return;
  description.depth_sensor = sensors.front();
  description.more_depth_sensors.assign(sensors.begin() + 1, sensors.end());
}

template <typename T>
void replace(std::vector<T>& value, const std::vector<T>& by) {
  if (!by.empty()) value = by;
}

void replace_region(bake::RegionDescription& region, const BakeCommand& command) {
  replace(region.parts, command.region_parts);
  if (command.region_nodes) region.node_ids.clear();
  replace(region.node_file, command.region_nodes);
  if (command.sensor) region.sensors = {*command.sensor};
  if (command.region_box.empty()) return;
  region.box.emplace();
  std::copy_n(command.region_box.begin(), 3, region.box->min.begin());
  std::copy_n(command.region_box.begin() + 3, 3, region.box->max.begin());
}

void replace_steps(bake::EnsembleDescription& description, const BakeCommand& command) {
  replace(description.impact_step, command.impact_step);
  if (command.steps)
    description.steps = *parse_step_selection(*command.steps);
  else if (command.impact_step)
    description.steps.first = std::max(description.steps.first, *command.impact_step);
}

}  // namespace

void declare(Tool& tool, BakeCommand& command) {
  const bake::EnsembleDescription defaults;
  tool.add_option("ENSEMBLE", command.toml, "ensemble.toml: what to bake; flags override it");
  tool.add_option("-o,--output", command.output,
                  "the model (default: the TOML file's output, else its name with .lbea in the working folder)");
  tool.add_option("--from", command.earlier, "an earlier model: the runs in it are copied from it and not read again")
      ->default_text("");
  tool.add_option("--run", command.runs, "a run's first file or folder; repeat it, instead of the TOML file's runs")
      ->default_text("");
  tool.add_option("--reference", command.reference_run,
                  "the run whose mesh is the reference: path or name (default: the first)");
  tool.add_option("--mode", command.mode, "impact: one reference mesh; over-time: one per step (default: impact)")
      ->check(one_of({"impact", "over-time"}));
  tool.add_option("--modes", command.modes, with_default("modes of the basis", defaults.modes));
  tool.add_option("--impact-step", command.impact_step,
                  with_default("the reference run's state at impact", defaults.impact_step));
  tool.add_option(
          "--steps", command.steps,
          "states that become samples: all, N, FIRST:LAST, FIRST:LAST:STRIDE or N,N,... (default: from impact on)")
      ->check(Check(check_steps, "STEPS"));
  declare_region(tool, command);
  declare_content(tool, command);
  tool.add_option("--threads", command.threads, "0: all processors; the model does not depend on it");
  tool.add_flag("--json", command.json, "print the summary as JSON");
  tool.add_usage_check([&command] {
    if (command.toml.empty() && command.runs.empty()) throw WrongUsage("name an ensemble.toml, or runs with --run");
    if (command.toml.empty() && command.output.empty()) throw WrongUsage("name the model with -o");
  });
}

std::optional<bake::StepSelection> parse_step_selection(const std::string& text) {
  bake::StepSelection selection;
  if (text == "all") return selection;
  if (const auto list = parsed_list<std::uint32_t>(text, ',')) {
    selection.list = *list;
    return selection;
  }
  const auto range = parsed_list<std::uint32_t>(text, ':');
  if (!range || range->size() > 3 || (*range)[0] > (*range)[1]) return std::nullopt;
  selection.first = (*range)[0];
  selection.last = (*range)[1];
  if (range->size() == 3) selection.stride = (*range)[2];
  if (selection.stride == 0) return std::nullopt;
  return selection;
}

bake::EnsembleDescription described(const BakeCommand& command) {
  bake::EnsembleDescription description =
      command.toml.empty() ? bake::EnsembleDescription{} : io::read_ensemble_toml(command.toml);
  if (!command.runs.empty()) {
    description.runs = command.runs;
    description.reference_run.clear();
  }
  if (command.reference_run) description.reference_run = find_run(description.runs, *command.reference_run);
  if (command.mode) description.mode = *command.mode == "impact" ? ReferenceMode::impact : ReferenceMode::over_time;
  replace(description.modes, command.modes);
  replace_steps(description, command);
  replace_region(description.region, command);
  replace(description.fields, command.fields);
  if (description.fields == std::vector<std::string>{"none"}) description.fields.clear();
  replace(description.parameters, command.parameters);
  replace(description.length_unit, command.length_unit);
  replace(description.time_factor, command.time_factor);
  if (command.envelope_margin) description.envelope_margin = command.envelope_margin;
  replace(description.correspondence, command.correspondence);
  replace(description.compact_fields, command.compact_fields);
  if (command.landmarks) description.landmarks = command.landmarks;
  if (command.sensor && description.depth_sensor.empty()) description.depth_sensor = *command.sensor;
  replace_views(description, command.views);
  if (!command.output.empty()) description.output = command.output;
  if (description.output.empty()) description.output = command.toml.stem().concat(".lbea");
  return description;
}

}  // namespace lbea::tool
