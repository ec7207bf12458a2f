#include "tools/shared/recording/rig_settings.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/file_names.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/text/formatted.hpp"

namespace lbea::tool {
namespace {

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
  std::vector<std::string> names;
  for (const NamedRig& rig : rigs) names.push_back(rig.name);
  const auto files = pose_files(values_per_rig(names, {"--pose", "FILE"}, options.poses));
  const auto offsets = values_per_rig(names, {"--clock-offset-ns", "NS"}, options.clock_offsets);
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    rigs[i].pose_file = files[i];
    if (offsets[i]) set_offset(rigs[i], *offsets[i]);
  }
  if (rigs.size() == 1 && !options.clock_offsets.empty()) throw WrongUsage("--clock-offset-ns needs several rigs");
  return rigs;
}

std::vector<std::optional<std::string>> values_per_recorded_rig(const std::vector<RigSettings>& rigs,
                                                                const std::string& option, const std::string& value,
                                                                const std::vector<std::string>& texts) {
  if (rigs.empty()) return values_per_rig({""}, {option, value}, texts);
  std::vector<std::string> names;
  std::string listed;
  for (const RigSettings& rig : rigs) {
    names.push_back(rig.name);
    listed += (listed.empty() ? "" : ", ") + rig.name;
  }
  return values_per_rig(names, {option, value, "a rig of the recording: " + listed}, texts);
}

std::vector<std::string> pose_files(const std::vector<std::optional<std::string>>& values) {
  std::vector<std::string> files;
  for (const auto& file : values) {
    if (file) require_file(*file);
    files.push_back(file.value_or(""));
  }
  return files;
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
