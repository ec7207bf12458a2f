#include "tools/shared/recording/recording_format.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

namespace lbea::tool {
namespace {

/// The shortest text that reads back as the same number.
template <class Number>
std::string text(Number number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

std::string text(const std::string& value) { return value; }
std::string text(Method method) { return text(static_cast<std::int32_t>(method)); }
std::string text(const RigidTransform& transform) {
  std::string line;
  for (const float value : transform) line += (line.empty() ? "" : " ") + text(value);
  return line;
}

/// Takes a value from the front of `from`; false when there is none.
template <class Number>
bool take(std::string_view& from, Number& into) {
  const auto [next, error] = std::from_chars(from.data(), from.data() + from.size(), into);
  from.remove_prefix(static_cast<std::size_t>(next - from.data()));
  return error == std::errc();
}
bool take(std::string_view& from, std::string& into) {
  into = std::exchange(from, {});
  return true;
}
bool take(std::string_view& from, Method& into) {
  std::int32_t number = 0;
  if (!take(from, number)) return false;
  into = static_cast<Method>(number);
  return true;
}
bool take(std::string_view& from, RigidTransform& into) {
  return std::ranges::all_of(into, [&](float& value) {
    if (from.starts_with(' ')) from.remove_prefix(1);
    return take(from, value);
  });
}

/// The settings with their keys in the file. Settings: RunSettings, also const.
template <class Settings, class Visit>
void for_each_setting(Settings& settings, const Visit& visit) {
  auto& matcher = settings.matcher;
  visit("program", settings.program);
  visit("model_file", settings.model_file);
  visit("model_checksum", settings.model_checksum);
  visit("method", settings.method);
  visit("method_number", matcher.method);
  visit("max_points", matcher.max_points);
  visit("max_matches", matcher.max_matches);
  visit("trusted_distance", matcher.trusted_distance);
  visit("min_coverage", matcher.min_coverage);
  visit("trigger_ns", matcher.trigger_ns);
  visit("T_reference_sensor", matcher.T_reference_sensor);
  visit("estimates_pose", settings.estimates_pose);
  visit("knows_impact", settings.knows_impact);
  visit("frames_alone", settings.frames_alone);
  visit("sensor_json", settings.sensor_json);
  visit("start_ns", settings.start_ns);
  visit("record_window", settings.record_window);
}

template <class Rig, class Visit>
void for_each_rig_setting(Rig& rig, const Visit& visit) {
  visit("name", rig.name);
  visit("T_reference_sensor", rig.T_reference_sensor);
  visit("clock_offset_ns", rig.clock_offset_ns);
  visit("sensor_json", rig.sensor_json);
}

template <class Component, class Visit>
void for_each_component_setting(Component& component, const Visit& visit) {
  visit("name", component.name);
  visit("model_file", component.model_file);
  visit("model_checksum", component.model_checksum);
}

constexpr std::array<std::string_view, 3> condition_names{"active", "ended", "silent"};

bool read(std::istream& in, wire::SenderCondition& condition) {
  std::string name;
  in >> name;
  const auto known = std::ranges::find(condition_names, name);
  condition = static_cast<wire::SenderCondition>(known - condition_names.begin());
  return known != condition_names.end();
}

constexpr std::uint32_t most_matches = 1000;  // as lbea-serve accepts

bool is_rigid(const RigidTransform& T) {
  constexpr double tolerance = 1e-3;
  if (!std::ranges::all_of(T, [](float value) { return std::isfinite(value); })) return false;
  const auto at = [&T](std::size_t row, std::size_t column) { return static_cast<double>(T[4 * row + column % 3]); };
  double determinant = 0;
  for (std::size_t k = 0; k < 3; ++k)
    determinant += at(0, k) * (at(1, k + 1) * at(2, k + 2) - at(1, k + 2) * at(2, k + 1));
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      const double dot = at(i, 0) * at(j, 0) + at(i, 1) * at(j, 1) + at(i, 2) * at(j, 2);
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > tolerance) return false;
    }
  return determinant > 0;
}

void require(bool holds, const std::string& what, const std::string& file) {
  if (!holds)
    throw Error(Status::bad_input, file + ": " + what + "; lbea does not record this: check where the file comes from");
}

void check(const MatcherConfig& matcher, const std::string& file) {
  require(matcher.max_matches >= 1 && matcher.max_matches <= most_matches,
          "max_matches is " + text(matcher.max_matches) + ", outside 1 to " + text(most_matches), file);
  require(is_rigid(matcher.T_reference_sensor), "T_reference_sensor is not a rigid transform", file);
  require(matcher.trusted_distance >= 0 && std::isfinite(matcher.trusted_distance),
          "trusted_distance is " + text(matcher.trusted_distance), file);
  require(matcher.min_coverage >= 0 && matcher.min_coverage <= 1, "min_coverage is " + text(matcher.min_coverage),
          file);
}

/// Reads a setting from its text, if there is one.
struct SettingReader {
  const mcap::Metadata& metadata;
  const std::string& file;

  template <class Value>
  void operator()(const std::string& key, Value& value) const {
    const auto found = metadata.texts.find(key);
    if (found == metadata.texts.end()) return;
    std::string_view rest = found->second;
    if (!take(rest, value) || !rest.empty())
      throw Error(Status::bad_input,
                  file + ": its metadata \"" + metadata.name + "\" has no valid number in \"" + key +
                      "\"; set it on the command line of a matcher instead of replaying into a model");
  }
};

}  // namespace

std::uint32_t checked_max_points(std::uint32_t points, const std::string& file) {
  require(points > 0 && points <= wire::WireLimits::most_points,
          "max_points is " + text(points) + ", outside 1 to " + text(wire::WireLimits::most_points), file);
  return points;
}

mcap::Metadata to_metadata(const RunSettings& settings) {
  mcap::Metadata metadata{std::string(settings_metadata_name), {}};
  for_each_setting(settings, [&](const char* key, const auto& value) { metadata.texts[key] = text(value); });
  return metadata;
}

mcap::Metadata to_metadata(const RigSettings& rig, std::size_t number) {
  mcap::Metadata metadata{std::string(rig_metadata_name), {{"number", text(number)}}};
  for_each_rig_setting(rig, [&](const char* key, const auto& value) { metadata.texts[key] = text(value); });
  return metadata;
}

std::vector<ComponentSettings> components_of(const wire::WireState& state) {
  std::vector<ComponentSettings> components;
  for (const wire::WireComponent& c : state.components) components.push_back({c.name, c.model.file, c.model.checksum});
  return components;
}

const ComponentSettings& component_with(const std::vector<ComponentSettings>& components, std::uint64_t model_checksum,
                                        const std::string& model_file, const std::string& recording) {
  const auto found = std::ranges::find(components, model_checksum, &ComponentSettings::model_checksum);
  if (found == components.end())
    throw Error(Status::bad_config, model_file + ": is not a model that the frames of " + recording +
                                        " were matched with; see lbea-inspect");
  return *found;
}

mcap::Metadata to_metadata(const ComponentSettings& component, std::size_t number) {
  mcap::Metadata metadata{std::string(component_metadata_name), {{"number", text(number)}}};
  for_each_component_setting(component, [&](const char* key, const auto& value) { metadata.texts[key] = text(value); });
  return metadata;
}

RigSettings rig_settings_from(const mcap::Metadata& metadata, const std::string& file) {
  RigSettings rig;
  for_each_rig_setting(rig, SettingReader{metadata, file});
  require(is_rigid(rig.T_reference_sensor), "T_reference_sensor of rig " + rig.name + " is not a rigid transform",
          file);
  return rig;
}

RunSettings settings_from(const mcap::Metadata& metadata, const std::string& file) {
  RunSettings settings;
  for_each_setting(settings, SettingReader{metadata, file});
  settings.matcher.max_points = checked_max_points(settings.matcher.max_points, file);
  check(settings.matcher, file);
  return settings;
}

void read(const mcap::Metadata& metadata, RunSettings& into, const std::string& file) {
  if (metadata.name == settings_metadata_name) {
    std::vector<RigSettings> rigs = std::move(into.rigs);
    std::vector<ComponentSettings> components = std::move(into.components);
    into = settings_from(metadata, file);
    into.rigs = std::move(rigs);
    into.components = std::move(components);
  } else if (metadata.name == rig_metadata_name && into.rigs.size() < wire::most_rigs) {
    into.rigs.push_back(rig_settings_from(metadata, file));
  } else if (metadata.name == component_metadata_name && into.components.size() < wire::most_components) {
    for_each_component_setting(into.components.emplace_back(), SettingReader{metadata, file});
  }
}

mcap::Metadata to_metadata(const std::vector<wire::WireSender>& senders, std::uint64_t interleaved) {
  mcap::Metadata metadata{std::string(senders_metadata_name),
                          {{std::string(interleaved_key), std::to_string(interleaved)}}};
  for (const wire::WireSender& sender : senders) {
    std::ostringstream key, text;
    key << std::hex << sender.session;
    text << sender.first_id << ' ' << sender.next_id << ' ' << sender.received << ' ' << sender.missed << ' '
         << sender.withheld << ' ' << condition_names[static_cast<std::size_t>(sender.condition)];
    metadata.texts[key.str()] = text.str();
  }
  return metadata;
}

std::vector<wire::WireSender> senders_from(const mcap::Metadata& metadata) {
  std::vector<wire::WireSender> senders;
  for (const auto& [session, account] : metadata.texts) {
    wire::WireSender sender;
    std::istringstream key(session), text(account);
    const bool is_read =
        key >> std::hex >> sender.session &&
        text >> sender.first_id >> sender.next_id >> sender.received >> sender.missed >> sender.withheld &&
        read(text, sender.condition);
    if (is_read && sender.first_id <= sender.next_id) senders.push_back(sender);
  }
  return senders;
}

}  // namespace lbea::tool
