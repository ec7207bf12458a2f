#include "tools/replay/replay_settings.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/clock_times.hpp"

#include <spdlog/spdlog.h>

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
    if (std::isfinite(result.fit.pose_turn)) return true;
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

/// Reports an unknown setting, because a default could change the results.
void report_unknown(const std::string& what, const SettingsOptions& options) {
  const std::string sentence = options.recording + ": the recording does not contain " + what;
  if (options.needs_all) throw Error(Status::bad_config, sentence);
  spdlog::warn(sentence);
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
  } else if (settings.method.empty()) {
    report_unknown("the method, because it contains no state of a matcher; give it with --method, otherwise it is lbea",
                   options);
  }
  settings.method = name_of(settings.matcher.method);
}

// Only lbea-serve records the pose, and whether its error was estimated.
void complete_pose(RunSettings& settings, const SettingsOptions& options) {
  if (settings.program.starts_with("lbea-record"))
    settings.estimates_pose = has_estimated_pose(options.recording) ? 1 : 0;
  if (!options.pose_file.empty()) {
    settings.matcher.T_reference_sensor = io::read_pose(options.pose_file);
    settings.sensor_json = io::as_text(io::read_file(options.pose_file));
  } else if (options.without_pose) {
    settings.matcher.T_reference_sensor = MatcherConfig{}.T_reference_sensor;
    settings.sensor_json.clear();
  } else if (settings.program.starts_with("lbea-record") && settings.sensor_json.empty()) {
    report_unknown(
        "the sensor's pose, because lbea-record does not know it; give it with --pose sensor.json, or give --no-pose "
        "if lbea-serve had none",
        options);
  }
}

constexpr double longest_s = 4e9;

std::optional<double> seconds(std::string_view text, double if_empty) {
  if (text.empty()) return if_empty;
  const auto value = parsed<double>(text);
  return value && std::abs(*value) <= longest_s ? value : std::nullopt;
}

std::optional<RecordedMessage> next_frame(RecordedRun& run) {
  auto message = run.next();
  while (message && message->kind != RecordedMessage::Kind::frame) message = run.next();
  return message;
}

}  // namespace

RunSettings replay_settings(RunSettings recorded, const Model& model, const SettingsOptions& options) {
  RunSettings settings = std::move(recorded);
  complete_method(settings, options);
  complete_pose(settings, options);
  if (settings.model_checksum != 0 && settings.model_checksum != model.checksum())
    spdlog::info("{} is not the model of the recording ({})", options.model_file, settings.model_file);
  settings.program = "lbea-replay " LBEA_VERSION_STRING;
  settings.model_file = options.model_file;
  settings.model_checksum = model.checksum();
  return settings;
}

Range::Range(const std::string& words) : text(words), from_s(-longest_s), to_s(longest_s) {
  if (text.empty()) return;
  const auto colon = text.find(':');
  const std::string_view view = text;
  const auto from = seconds(view.substr(0, colon), -longest_s), to = seconds(view.substr(colon + 1), longest_s);
  if (colon == std::string::npos || !from || !to)
    throw WrongUsage("--range \"" + text + "\": not FROM:TO in seconds; write e.g. 0.5:2");
  if (*from > *to) throw WrongUsage("--range \"" + text + "\": it ends before it begins; write FROM:TO, e.g. 0.5:2");
  from_s = *from;
  to_s = *to;
}

Part part_of(RecordedRun& run, const Range& range, const std::string& file) {
  run.rewind();
  const auto first = next_frame(run);
  if (!first) throw Error(Status::bad_input, file + ": it contains no frame; see lbea-inspect");
  if (range.text.empty()) return {};
  const std::int64_t begin = first->log_time_ns;
  const Part part{saturated_sum(begin, static_cast<std::int64_t>(range.from_s * 1e9)),
                  saturated_sum(begin, static_cast<std::int64_t>(range.to_s * 1e9)), false};
  run.rewind();
  run.limit(part.from_ns, part.to_ns);
  if (!next_frame(run))
    throw Error(Status::bad_input,
                file + ": no frame in --range " + range.text +
                    ", seconds after the first frame; lbea-inspect prints the length of the recording");
  run.limit(Part{}.from_ns, Part{}.to_ns);
  return part;
}

std::int64_t history_of(RecordedRun& run, const Part& part, const FrameFates& fates) {
  std::int64_t begin = part.from_ns;
  std::optional<TestKey> test;
  run.rewind();
  while (const auto frame = next_frame(run)) {
    if (fates.was_dropped({frame->session, frame->id})) continue;
    const TestKey test_now = fates.test_of({frame->session, frame->id});
    if (std::exchange(test, test_now) != test_now) begin = frame->log_time_ns;
    if (frame->log_time_ns >= part.from_ns) break;
  }
  return std::min(begin, part.from_ns);
}

}  // namespace lbea::tool
