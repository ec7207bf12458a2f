#include "tools/report/content/test_report.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "tools/report/content/own_match.hpp"
#include "tools/shared/matching/views.hpp"

#include <algorithm>
#include <limits>

namespace lbea::tool {
namespace {

ReadingProgress stage(const StageReporter& report, std::string name) {
  return [&report, name = std::move(name)](std::uint64_t done, std::uint64_t total) { report(name, done, total); };
}

std::uint64_t recorded_checksum(const RecordingContent& content) {
  const std::uint64_t by_settings = content.audit.settings.model_checksum;
  return by_settings != 0 ? by_settings : content.model_checksum;
}

std::filesystem::path model_file_of(const ReportOptions& options, const RecordingContent& content) {
  if (!options.model_file.empty()) return options.model_file;
  const std::string& recorded = content.audit.settings.model_file;
  if (recorded.empty())
    throw Error(Status::bad_config, options.recording.string() + ": does not name its model; give it with --model");
  return recorded;
}

Model open_model(const std::filesystem::path& file, const RecordingContent& content) {
  Model model = Model::open(file);
  const std::uint64_t checksum = recorded_checksum(content);
  if (checksum != 0 && model.checksum() != checksum)
    throw Error(Status::bad_config, file.string() + ": is not the model that the frames of " + content.file.string() +
                                        " were matched with; give that one with --model");
  return model;
}

void require_content(const RecordingContent& content) {
  if (content.audit.frames > 0 || content.audit.results > 0) return;
  const auto flaws = content.audit.flaws();
  throw Error(Status::bad_input, content.file.string() + ": contains no frame and no result" +
                                     (flaws.empty() ? "" : " (" + flaws.front() + ")") + "; see lbea-inspect");
}

std::optional<std::size_t> place_of(const ReportOptions& options, const RecordingContent& content) {
  if (options.test) {
    if (*options.test == 0 || *options.test > content.tests.size())
      throw Error(Status::bad_config, "--test " + std::to_string(*options.test) + ": the recording has " +
                                          std::to_string(content.tests.size()) + " tests with matched frames");
    return *options.test - 1;
  }
  if (content.tests.empty()) return std::nullopt;
  const auto longest = std::ranges::max_element(
      content.tests, {}, [](const RecordedTest& test) { return test.record.answer().matched(); });
  return static_cast<std::size_t>(longest - content.tests.begin());
}

/// The baked images' limits hold for frames from their pose; for others, the matcher has rendered images.
void find_limits(TestReport& report) {
  const SensorViews views = SensorViews::baked_into(report.model, report.T_reference_sensor);
  if (views.empty() || !has_images_for(report.T_reference_sensor, report.model)) return;
  report.frame_limit = double{views.misfit_limit()};
  report.test_limit = double{views.test_misfit_limit()};
}

void find_poses(TestReport& report, const ReportOptions& options) {
  report.T_reference_sensor = options.without_pose ? identity_transform
                              : options.pose_file.empty()
                                  ? report.settings().matcher.T_reference_sensor
                                  : io::read_pose(options.pose_file, report.model.length_unit());
  report.T_reference_view = report.T_reference_sensor;
  const SensorViews views = SensorViews::baked_into(report.model);
  if (report.T_reference_view == identity_transform && !views.empty())
    report.T_reference_view = views.T_reference_sensor();
}

void study_frames(TestReport& report, const StageReporter& progress) {
  if (!report.test) return;
  const RecordedTest& test = report.content.tests[*report.test];
  const std::vector<ChosenFrame> chosen = chosen_frames(test), with_forecasts = frames_with_forecasts(test);
  std::vector<CaptureKey> keys;
  for (const auto* some : {&chosen, &with_forecasts})
    for (const ChosenFrame& frame : *some) keys.push_back(frame.key);
  auto frames = read_frames(report.content.file, keys, report.T_reference_sensor, report.settings().rigs,
                            stage(progress, "reading frames"));
  for (auto& [key, frame] : frames)
    if (const auto own = report.own_results.find(key); own != report.own_results.end()) frame.result = own->second;
  report.forecasts = study_forecasts(report.model, with_forecasts, frames);
  report.frames = study(report.model, chosen, std::move(frames), stage(progress, "comparing frames"));
  report.regions = regions_of(report.model, report.frames);
}

/// By the verdict of the test; without one, as of matched frames alone, by that of the last frame.
bool is_explained(const TestReport& report) {
  const wire::WireVerdict verdict =
      report.state().frames > 0 ? report.state().verdict : report.record()->latest()->verdict;
  return verdict == wire::WireVerdict::matched || verdict == wire::WireVerdict::ambiguous;
}

void explain(TestReport& report) {
  const RunAudit& audit = report.content.audit;
  report.accounts = report.is_own_match ? accounts_of(report.own_counters) : accounts_of(audit);
  TestFacts facts;
  facts.record = report.record();
  facts.refusal = refusal_of_all(report.accounts.counters, report.model.length_unit());
  facts.names = report.names;
  facts.method = audit.settings.method.empty() ? "an unknown method" : audit.settings.method;
  facts.test_limit = report.test_limit;
  report.explanation = explain(facts);
  if (facts.record != nullptr) report.warnings = facts.record->answer().warnings();
  if (audit.counters && audit.counters->interleaved > 0)
    report.warnings.push_back("the frames of different senders alternate: they are not one test");
}

}  // namespace

const wire::WireTestState& TestReport::state() const noexcept {
  static const wire::WireTestState none;
  return test ? content.tests[*test].record.answer().state() : none;
}

const wire::WireForecast& TestReport::forecast() const noexcept {
  static const wire::WireForecast none;
  const TestRecord* of_test = record();
  return of_test != nullptr && of_test->latest() ? of_test->latest()->forecast : none;
}

TestReport make_report(const ReportOptions& options, const StageReporter& progress) {
  RecordingContent content =
      read_recording(options.recording, stage(progress, "reading results"),
                     options.keeps_all_frames ? std::numeric_limits<std::size_t>::max() : TestRecord::default_capacity);
  require_content(content);
  if (!content.audit.settings.components.empty())
    throw Error(Status::bad_input, options.recording.string() +
                                       ": was matched with the models of several components, which lbea-report does "
                                       "not read yet; see lbea-replay and lbea-monitor --model");
  const std::filesystem::path model_file = model_file_of(options, content);
  Model model = open_model(model_file, content);
  TestReport report(std::move(content), std::move(model), model_file);
  for (std::uint32_t i = 0; i < report.model.simulations(); ++i)
    report.names.emplace_back(report.model.simulation_name(i));
  find_poses(report, options);
  if (report.content.audit.results == 0) match_frames(report, options, stage(progress, "matching"));
  report.test = place_of(options, report.content);
  find_limits(report);
  study_frames(report, progress);
  if (report.record() != nullptr) {
    report.channels = study_channels(report.model, *report.record(), require_not_stopped);
    report.fields = compare_fields(report.model, report.frames, report.channels, is_explained(report));
  }
  explain(report);
  return report;
}

}  // namespace lbea::tool
