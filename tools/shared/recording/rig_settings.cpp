#include "tools/shared/recording/rig_settings.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/file_names.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/rig_options.hpp"
#include "tools/shared/text/formatted.hpp"

namespace lbea::tool {
namespace {

/// Gives the values of an option to the rigs that they name.
template <class Use>
void assign(std::vector<NamedRig>& rigs, const std::vector<std::string>& texts, const PerRigOption& option,
            const Use& use) {
  std::vector<std::string> names;
  for (const NamedRig& rig : rigs) names.push_back(rig.name);
  const auto values = values_per_rig(names, option, texts);
  for (std::size_t i = 0; i < rigs.size(); ++i)
    if (values[i]) use(rigs[i], *values[i]);
}

void require_file(const std::string& file) {
  if (!std::filesystem::is_regular_file(io::path_of(file))) throw WrongUsage("--pose: " + file + " is not a file");
}

void set_offset(NamedRig& rig, const std::string& value) {
  constexpr std::int64_t most = 1'000'000'000'000'000'000;  // 31 years
  const auto offset = parsed<std::int64_t>(value);
  if (!offset || *offset < -most || *offset > most)
    throw WrongUsage("--clock-offset-ns: \"" + value + "\" is not a whole number of ns up to 10^18");
  rig.clock_offset_ns = *offset;
}

}  // namespace

std::vector<NamedRig> read_rigs(const RigOptions& options) {
  std::vector<NamedRig> rigs;
  for (const auto& [name, endpoint] : read_rig_endpoints(options.frames)) {
    NamedRig& rig = rigs.emplace_back();
    rig.name = name;
    rig.endpoint = endpoint;
  }
  assign(rigs, options.poses, {"--pose", "FILE"}, [](NamedRig& rig, const std::string& file) {
    require_file(file);
    rig.pose_file = file;
  });
  assign(rigs, options.clock_offsets, {"--clock-offset-ns", "NS"}, set_offset);
  if (rigs.size() == 1 && !options.clock_offsets.empty()) throw WrongUsage("--clock-offset-ns needs several rigs");
  return rigs;
}

void read_poses(std::vector<NamedRig>& rigs, std::string_view length_unit) {
  for (NamedRig& rig : rigs) {
    if (rig.pose_file.empty()) continue;
    const std::filesystem::path file = io::path_of(rig.pose_file);
    rig.T_reference_sensor = io::read_pose(file, length_unit);
    rig.sensor_json = io::as_text(io::read_file(file));
  }
}

std::vector<std::pair<std::string, std::string>> frames_endpoints(const std::vector<NamedRig>& rigs) {
  std::vector<std::pair<std::string, std::string>> endpoints;
  for (const NamedRig& rig : rigs)
    endpoints.emplace_back(rigs.size() > 1 ? "--frames " + rig.name : "--frames", rig.endpoint);
  return endpoints;
}

}  // namespace lbea::tool
