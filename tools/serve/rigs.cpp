#include "tools/serve/rigs.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/rig_options.hpp"
#include "tools/shared/matching/views.hpp"

namespace lbea::tool {
namespace {

/// Gives the values of an option to the rigs that they name.
template <class Use>
void assign(std::vector<ServedRig>& rigs, const std::vector<std::string>& texts, const PerRigOption& option,
            const Use& use) {
  std::vector<std::string> names;
  for (const ServedRig& rig : rigs) names.push_back(rig.name);
  const auto values = values_per_rig(names, option, texts);
  for (std::size_t i = 0; i < rigs.size(); ++i)
    if (values[i]) use(rigs[i], *values[i]);
}

void require_file(const std::string& file) {
  if (!std::filesystem::is_regular_file(file)) throw WrongUsage("--pose: " + file + " is not a file");
}

void set_offset(ServedRig& rig, const std::string& value) {
  constexpr std::int64_t most = 1'000'000'000'000'000'000;  // 31 years
  const auto offset = parsed<std::int64_t>(value);
  if (!offset || *offset < -most || *offset > most)
    throw WrongUsage("--clock-offset-ns: \"" + value + "\" is not a whole number of ns up to 10^18");
  rig.clock_offset_ns = *offset;
}

}  // namespace

std::vector<ServedRig> read_rigs(const RigOptions& options) {
  std::vector<ServedRig> rigs;
  for (const auto& [name, endpoint] : read_rig_endpoints(options.frames)) {
    ServedRig& rig = rigs.emplace_back();
    rig.name = name;
    rig.endpoint = endpoint;
  }
  assign(rigs, options.poses, {"--pose", "FILE"}, [](ServedRig& rig, const std::string& file) {
    require_file(file);
    rig.pose_file = file;
  });
  assign(rigs, options.clock_offsets, {"--clock-offset-ns", "NS"}, set_offset);
  if (rigs.size() == 1 && !options.clock_offsets.empty()) throw WrongUsage("--clock-offset-ns needs several rigs");
  return rigs;
}

void read_poses(std::vector<ServedRig>& rigs, const Model& model) {
  for (ServedRig& rig : rigs) {
    if (rig.pose_file.empty()) continue;
    rig.T_reference_sensor = io::read_pose(rig.pose_file, model.length_unit());
    rig.sensor_json = io::as_text(io::read_file(rig.pose_file));
  }
}

SensorViews views_for(const ServedRig& rig, const MatcherConfig& config, const Model& model) {
  MatcherConfig own = config;
  own.T_reference_sensor = rig.T_reference_sensor;
  return views_for(own, model, rig.sensor_json, rig.pose_file);
}

std::vector<Rig> matched_rigs(const std::vector<ServedRig>& rigs, const MatcherConfig& config, const Model& model) {
  std::vector<Rig> matched;
  for (const ServedRig& rig : rigs)
    matched.push_back({rig.T_reference_sensor, views_for(rig, config, model), rig.clock_offset_ns});
  return matched;
}

}  // namespace lbea::tool
