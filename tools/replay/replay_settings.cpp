#include "tools/replay/replay_settings.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

/// The first one that a matcher published.
std::optional<wire::WireState> recorded_state(const std::string& file) {
  RecordedRun run(file);
  wire::WireState state;
  while (const auto message = run.next())
    if (message->kind == RecordedMessage::Kind::state &&
        wire::decode_state(message->data, state) == wire::WireStatus::ok && !state.method.empty())
      return state;
  return {};
}

Method method_of(const std::string& name, const std::string& file) {
  const auto found = method_names.find(name);
  if (found == method_names.end())
    throw Error(Status::bad_input,
                file + ": was matched by \"" + name + "\", which is not known here; give the method with --method");
  return found->second;
}

/// Why a sentence and not a default: without it the results are others.
void miss(const std::string& what, const SettingsOptions& options) {
  const std::string sentence = options.recording + ": the recording does not know " + what;
  if (options.needs_all) throw Error(Status::bad_config, sentence);
  spdlog::warn(sentence);
}

void complete_method(RunSettings& settings, const SettingsOptions& options) {
  if (const auto state = settings.method.empty() ? recorded_state(options.recording) : std::nullopt) {
    settings.method = state->method;
    settings.model_file = state->model.file;
    settings.model_checksum = state->model.checksum;
    settings.matcher.max_points = state->max_points;
    if (!options.method) settings.matcher.method = method_of(state->method, options.recording);
  }
  if (options.method) {
    settings.matcher.method = *options.method;
  } else if (settings.method.empty()) {
    miss("the method (none of a matcher's states is in it); give it with --method, else it is lbea", options);
  }
  settings.method = name_of(settings.matcher.method);
}

// Only the matcher is told the pose.
void complete_pose(RunSettings& settings, const SettingsOptions& options) {
  if (!options.pose_file.empty()) {
    settings.matcher.T_reference_sensor = io::read_pose(options.pose_file);
    settings.sensor_json = io::as_text(io::read_file(options.pose_file));
  } else if (options.without_pose) {
    settings.matcher.T_reference_sensor = MatcherConfig{}.T_reference_sensor;
    settings.sensor_json.clear();
  } else if (settings.program.starts_with("lbea-record") && settings.sensor_json.empty()) {
    miss(
        "the sensor's pose, as lbea-record is not told it; give it with --pose sensor.json, or --no-pose where "
        "lbea-serve had none",
        options);
  }
}

}  // namespace

RunSettings replay_settings(RunSettings recorded, const Model& model, const SettingsOptions& options) {
  RunSettings settings = std::move(recorded);
  complete_method(settings, options);
  complete_pose(settings, options);
  if (settings.model_checksum != 0 && settings.model_checksum != model.checksum())
    spdlog::info("{} is not the model it was recorded with ({})", options.model_file, settings.model_file);
  settings.program = "lbea-replay " LBEA_VERSION_STRING;
  settings.model_file = options.model_file;
  settings.model_checksum = model.checksum();
  return settings;
}

}  // namespace lbea::tool
