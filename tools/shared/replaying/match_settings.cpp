#include "tools/shared/replaying/match_settings.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/intake/log.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

/// The first recorded state of a matcher.
std::optional<wire::WireState> recorded_state(const std::string& file) {
  RecordedRun run(file);
  wire::WireState state;
  while (const auto message = run.next())
    if (message->kind == RecordedMessage::Kind::state &&
        wire::decode_state(message->data, state) == wire::WireStatus::ok && !state.method.empty())
      return state;
  return {};
}

/// Whether the matcher estimated the pose error of the tests, by its results of method fit.
/// Without results of fit: as lbea-serve does.
bool has_estimated_pose(const std::string& file) {
  RecordedRun run(file);
  wire::WireResult result;
  bool has_fit = false;
  while (const auto message = run.next()) {
    if (message->kind != RecordedMessage::Kind::result ||
        wire::decode_result(message->data, result) != wire::WireStatus::ok || result.fit.candidates.empty())
      continue;
    if (std::isfinite(result.fit.pose_turn) ||
        std::ranges::any_of(result.rigs, [](const auto& rig) { return std::isfinite(rig.pose_turn); }))
      return true;
    has_fit = true;
  }
  return !has_fit;
}

Method method_of(const std::string& name, const std::string& file) {
  const auto found = method_names.find(name);
  if (found == method_names.end())
    throw Error(Status::bad_input,
                file + ": was matched by the unknown method \"" + name + "\"; give the method with --method");
  return found->second;
}

/// lbea-record knows little of the matcher.
bool is_of_recorder(const RunSettings& settings) { return settings.program.starts_with("lbea-record"); }

/// Reports an unknown setting, because a default could change the results.
void report_unknown(const std::string& what, const SettingsOptions& options) {
  const std::string sentence = options.recording + ": the recording does not contain " + what;
  if (options.needs_all) throw Error(Status::bad_config, sentence);
  log_warning("{}", sentence);
}

void complete_method(RunSettings& settings, const SettingsOptions& options) {
  if (const auto state = settings.method.empty() ? recorded_state(options.recording) : std::nullopt) {
    settings.method = state->method;
    settings.model_file = state->model.file;
    settings.model_checksum = state->model.checksum;
    settings.matcher.max_points = checked_max_points(state->max_points, options.recording);
    if (!options.method) settings.matcher.method = method_of(state->method, options.recording);
  }
  if (options.method) {
    settings.matcher.method = *options.method;
  } else if (!settings.rigs.empty()) {
    settings.matcher.method = Method::fit;
  } else if (settings.method.empty()) {
    report_unknown("the method, because it contains no state of a matcher; give it with --method, otherwise it is lbea",
                   options);
  }
  settings.method = name_of(settings.matcher.method);
}

// Only lbea-serve records the pose, and whether its error was estimated.
void complete_pose(RunSettings& settings, const SettingsOptions& options, std::string_view length_unit) {
  if (is_of_recorder(settings)) settings.estimates_pose = has_estimated_pose(options.recording) ? 1 : 0;
  for (std::size_t i = 0; i < options.rig_pose_files.size(); ++i) {
    const std::string& file = options.rig_pose_files[i];
    if (file.empty()) continue;
    settings.rigs[i].T_reference_sensor = io::read_pose(file, length_unit);
    settings.rigs[i].sensor_json = io::as_text(io::read_file(file));
  }
  if (!options.pose_file.empty()) {
    settings.matcher.T_reference_sensor = io::read_pose(options.pose_file);
    settings.sensor_json = io::as_text(io::read_file(options.pose_file));
  } else if (options.without_pose) {
    settings.matcher.T_reference_sensor = MatcherConfig{}.T_reference_sensor;
    settings.sensor_json.clear();
    for (RigSettings& rig : settings.rigs) {
      rig.T_reference_sensor = MatcherConfig{}.T_reference_sensor;
      rig.sensor_json.clear();
    }
  } else if (is_of_recorder(settings) && !settings.rigs.empty()) {
    for (const RigSettings& rig : settings.rigs)
      if (rig.sensor_json.empty())
        throw Error(Status::bad_config, options.recording + ": the recording does not contain the pose of rig " +
                                            rig.name + ", because lbea-record was not given it; give --pose " +
                                            rig.name + "=sensor.json, or --no-pose if lbea-serve had none");
  } else if (is_of_recorder(settings) && settings.sensor_json.empty()) {
    report_unknown(
        "the sensor's pose, because lbea-record does not know it; give it with --pose sensor.json, or give --no-pose "
        "if lbea-serve had none",
        options);
  }
}

void require_recorded_settings(const RunSettings& settings, const SettingsOptions& options) {
  const bool drops_poses = options.without_pose && !is_of_recorder(settings);
  if (drops_poses || options.frames_alone || options.method.value_or(Method::fit) != Method::fit)
    throw Error(
        Status::bad_config,
        options.recording + ": frames of several rigs are matched by fit with their poses; omit " +
            (is_of_recorder(settings) ? "--frames-alone and other methods; give --no-pose if lbea-serve had none"
                                      : "--no-pose, --frames-alone and other methods"));
}

}  // namespace

std::vector<ComponentSettings> recorded_components(const RunSettings& recorded, const std::string& file) {
  if (!recorded.components.empty() || !recorded.method.empty()) return recorded.components;
  const auto state = recorded_state(file);
  return state ? components_of(*state) : std::vector<ComponentSettings>();
}

RunSettings replay_settings(RunSettings recorded, const Model& model, const SettingsOptions& options) {
  RunSettings settings = std::move(recorded);
  if (!settings.rigs.empty()) require_recorded_settings(settings, options);
  complete_method(settings, options);
  complete_pose(settings, options, model.length_unit());
  if (options.frames_alone) settings.frames_alone = 1;
  if (settings.model_checksum != 0 && settings.model_checksum != model.checksum())
    log_info("{} is not the model of the recording ({})", options.model_file, settings.model_file);
  settings.model_file = options.model_file;
  settings.model_checksum = model.checksum();
  return settings;
}

}  // namespace lbea::tool
