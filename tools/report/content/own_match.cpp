#include "tools/report/content/own_match.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/replaying/frame_fates.hpp"
#include "tools/shared/replaying/match_replay.hpp"
#include "tools/shared/views/views.hpp"

namespace lbea::tool {
namespace {

/// The recorded settings. Without a recorded method: fit where the model has depth images for the pose.
RunSettings settings_for(const TestReport& report, const ReportOptions& options) {
  SettingsOptions wanted;
  wanted.recording = options.recording.string();
  wanted.model_file = report.model_file.string();
  wanted.pose_file = options.pose_file;
  wanted.without_pose = options.without_pose;
  if (report.settings().method.empty())
    wanted.method = has_images_for(report.T_reference_sensor, report.model) ? Method::fit : Method::lbea;
  return replay_settings(report.settings(), report.model, wanted);
}

/// What pictures need of a result.
wire::WireResult without_evidence(wire::WireResult result) {
  result.fit.candidates.clear();
  result.fit.ranks.clear();
  result.test = {};
  return result;
}

}  // namespace

void match_frames(TestReport& report, const ReportOptions& options, const ReadingProgress& progress) {
  if (!report.settings().rigs.empty())
    throw Error(Status::bad_input, options.recording.string() +
                                       ": has frames of several rigs, and no results of them by this model; record "
                                       "them with lbea-serve, or match them with lbea-replay");
  RunSettings settings = settings_for(report, options);
  RecordedRun run(options.recording);
  const FrameFates fates(run);
  const std::string sensor_name = options.pose_file.empty() ? options.recording.string() : options.pose_file;
  const SensorViews views = views_for(settings.matcher, report.model, settings.sensor_json, sensor_name);
  MatchReplay replay(report.model, settings, views, 1);
  TestCollector tests(std::span(&report.content, 1));
  std::uint64_t frames = 0;
  const ResultHandler add = [&](const wire::WireResult& result, const TestKey&) {
    ++report.own_counters.received;
    ++report.own_counters.by_status[static_cast<std::size_t>(result.status)];
    if (wire::fate_of(result.status) == wire::Fate::matched)
      report.own_results.try_emplace({result.session, result.frame_id}, without_evidence(result));
    tests.add(result);
    if (progress) progress(++frames, report.content.audit.frames);
    return stop_requested == 0;
  };
  run.rewind();
  while (const auto message = run.next()) {
    require_not_stopped();
    if (message->kind == RecordedMessage::Kind::frame)
      static_cast<void>(replay.add({*message, fates.test_of({message->session, message->id})}, add));
  }
  static_cast<void>(replay.flush(add));
  settings.program = report.settings().program;
  report.content.audit.settings = std::move(settings);
  report.is_own_match = true;
}

}  // namespace lbea::tool
