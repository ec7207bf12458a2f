#include "tools/shared/ensemble/ensemble_input.hpp"

#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/simulation/open.hpp"
#include "precompute/rig/depth_renderer.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tools/shared/text/printable.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>

namespace lbea::tool {
namespace {

const std::string lone_file = "lbea-file:";  // before the path of a run that is one file of a numbered series

/// Where each run is read from. Several files of one numbered series are runs of one state each; a file that is named
/// without others of its series stands for the whole series.
std::vector<std::string> sources_of(const std::vector<std::filesystem::path>& runs) {
  std::map<std::string, std::size_t> named;
  for (const auto& run : runs) ++named[io::series_name(run)];
  std::vector<std::string> sources;
  for (const auto& run : runs) {
    const std::string series = io::series_name(run);
    sources.push_back((!series.empty() && named[series] > 1 ? lone_file : "") +
                      std::filesystem::absolute(run).string());
  }
  return sources;
}

std::string label(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

void add_parameters(bake::Ensemble& ensemble, const std::filesystem::path& file) {
  const io::ParameterTable table = io::read_parameters_csv(file);
  for (std::size_t i = 0; i < table.names.size(); ++i)
    ensemble.parameter_names.push_back(label(table.names[i], table.units[i]));
  for (bake::EnsembleRun& run : ensemble.runs) {
    const auto row = table.row(run.name);
    if (!row)
      throw Error(Status::bad_config,
                  file.string() + " has no line for run " + run.name + "; add one or leave the run out");
    run.parameters.assign(row->begin(), row->end());
  }
}

void add_listed_nodes(bake::RegionDescription& region) {
  if (region.node_file.empty()) return;
  const auto ids = io::read_node_ids(region.node_file);
  if (ids.empty()) throw Error(Status::bad_config, region.node_file.string() + " contains no node id");
  region.node_ids.insert(region.node_ids.end(), ids.begin(), ids.end());
}

}  // namespace

std::string run_name(const std::filesystem::path& run) {
  std::filesystem::path path = std::filesystem::absolute(run).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path.filename() == "d3plot" ? path.parent_path().filename().string() : path.filename().string();
}

std::filesystem::path find_run(const std::vector<std::filesystem::path>& runs, const std::string& name) {
  const auto found = std::ranges::find_if(
      runs, [&](const std::filesystem::path& run) { return run == name || run_name(run) == name; });
  if (found == runs.end()) throw Error(Status::bad_config, "the reference run '" + name + "' is none of the runs");
  return *found;
}

std::unique_ptr<bake::SimulationReader> open_run(const std::string& source) {
  const bool is_alone = source.starts_with(lone_file);
  return io::open_simulation(is_alone ? source.substr(lone_file.size()) : source, is_alone);
}

std::unique_ptr<bake::SimulationReader> open_named_run(const std::filesystem::path& run, bool is_single_file) {
  auto reader = io::open_simulation(run, is_single_file);
  if (const auto files = reader->files(); !io::series_name(run).empty() && files.size() > 1)
    std::fprintf(stderr, "%s to %s are read as the states of one run; for one of them alone, give --single-file\n",
                 printable(files.front().string()).c_str(), printable(files.back().string()).c_str());
  return reader;
}

bake::Ensemble open_ensemble(const bake::EnsembleDescription& description) {
  const auto check = [&](const std::filesystem::path& sensor) {
    if (!sensor.empty()) static_cast<void>(io::read_sensor_json(sensor, description.length_unit));
  };
  std::ranges::for_each(description.region.sensors, check);
  std::ranges::for_each(rigs_of(description), check);
  bake::Ensemble ensemble;
  const std::vector<std::string> sources = sources_of(description.runs);
  for (std::size_t i = 0; const std::filesystem::path& run : description.runs) {
    const bool is_alone = sources[i].starts_with(lone_file);
    const auto open = [run, is_alone] { return io::open_simulation(run, is_alone); };
    ensemble.runs.push_back({run_name(run), {}, open, sources[i++]});
  }
  if (!description.reference_run.empty()) {
    const auto found = std::ranges::find(description.runs, description.reference_run);
    ensemble.reference_run = static_cast<std::size_t>(found - description.runs.begin());
  }
  if (!description.parameters.empty()) add_parameters(ensemble, description.parameters);
  return ensemble;
}

std::vector<std::filesystem::path> rigs_of(const bake::EnsembleDescription& description) {
  std::vector<std::filesystem::path> rigs = description.more_depth_sensors;
  if (!description.depth_sensor.empty()) rigs.insert(rigs.begin(), description.depth_sensor);
  return rigs;
}

void complete_region(bake::RegionDescription& region, std::span<const std::filesystem::path> rigs) {
  add_listed_nodes(region);
  if (!region.has_criteria()) region.sensors.assign(rigs.begin(), rigs.end());
}

decltype(bake::BakeOptions::visible_nodes) visibility(const bake::RegionDescription& region) {
  if (region.sensors.empty()) return {};
  std::vector<io::SensorDescription> rigs;
  for (const std::filesystem::path& sensor : region.sensors) rigs.push_back(io::read_sensor_json(sensor));
  return [rigs](const bake::CommonMesh& mesh, std::span<const float> positions) {
    std::vector<std::uint8_t> visible(mesh.node_ids.size());
    for (const io::SensorDescription& rig : rigs) {
      const bake::VirtualSensor sensor(rig.sensor, mesh.node_ids.size(), mesh.elements);
      const auto of_rig = sensor.visible_nodes({positions}, rig.noise.min_cos_incidence);
      std::ranges::transform(visible, of_rig, visible.begin(), std::bit_or{});
    }
    return visible;
  };
}

bake::DepthRendering depth_rendering(const std::filesystem::path& sensor) {
  if (sensor.empty()) return {};
  const io::SensorDescription description = io::read_sensor_json(sensor);
  return
      [description](const bake::CommonMesh& mesh, const std::array<float, 3>& low, const std::array<float, 3>& high) {
        return bake::make_depth_renderer(description.sensor, mesh.node_ids.size(), mesh.elements, low, high);
      };
}

void add_depth_renderers(bake::BakeOptions& options, const bake::EnsembleDescription& description) {
  options.depth_renderer = depth_rendering(description.depth_sensor);
  for (const std::filesystem::path& sensor : description.more_depth_sensors)
    options.more_depth_renderers.push_back(depth_rendering(sensor));
}

}  // namespace lbea::tool
