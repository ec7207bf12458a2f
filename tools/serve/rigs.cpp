#include "tools/serve/rigs.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/views.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::size_t longest_name = 32;

/// NAME and VALUE of "NAME=VALUE"; without a name the whole text is the value.
std::pair<std::string, std::string> divide(const std::string& text) {
  constexpr std::string_view of_names = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  const std::size_t at = text.find_first_not_of(of_names);
  if (at == 0 || at == std::string::npos || text[at] != '=') return {{}, text};
  return {text.substr(0, at), text.substr(at + 1)};
}

/// Gives the values of an option to the rigs that they name.
template <class Use>
void assign(std::vector<ServedRig>& rigs, const std::vector<std::string>& texts, const std::string& option,
            const std::string& what, const Use& use) {
  std::vector<const ServedRig*> given;
  for (const std::string& text : texts) {
    const bool is_alone = rigs.size() == 1 && rigs.front().name.empty();
    const auto [name, value] = is_alone ? std::pair(std::string(), text) : divide(text);
    auto rig = std::ranges::find(rigs, name, &ServedRig::name);
    if (rigs.size() == 1 && name.empty()) rig = rigs.begin();
    if (rig == rigs.end())
      throw WrongUsage(option + " " + text + ": give " + option + " NAME=" + what +
                       " with the name of a rig of --frames");
    if (std::ranges::find(given, &*rig) != given.end())
      throw WrongUsage(option + " is given twice" + (name.empty() ? "" : " for " + name));
    given.push_back(&*rig);
    use(*rig, value);
  }
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
  const bool is_alone = options.frames.size() == 1;
  if (options.frames.size() > wire::most_rigs)
    throw WrongUsage("--frames: give at most " + std::to_string(wire::most_rigs) + " rigs");
  for (const std::string& text : options.frames) {
    const auto [name, endpoint] = divide(text);
    if ((name.empty() && !is_alone) || name.size() > longest_name || endpoint.empty())
      throw WrongUsage("--frames " + text + ": with several rigs, give NAME=ENDPOINT; names have up to " +
                       std::to_string(longest_name) + " letters, digits, _ and -");
    if (std::ranges::find(rigs, name, &ServedRig::name) != rigs.end())
      throw WrongUsage("--frames: the name " + name + " is given to two rigs");
    ServedRig& rig = rigs.emplace_back();
    rig.name = name;
    rig.endpoint = endpoint;
  }
  assign(rigs, options.poses, "--pose", "FILE", [](ServedRig& rig, const std::string& file) {
    require_file(file);
    rig.pose_file = file;
  });
  assign(rigs, options.clock_offsets, "--clock-offset-ns", "NS", set_offset);
  if (is_alone && !options.clock_offsets.empty()) throw WrongUsage("--clock-offset-ns needs several rigs");
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
