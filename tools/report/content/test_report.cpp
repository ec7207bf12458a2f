#include "tools/report/content/test_report.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "tools/report/content/comparison/lost_elements.hpp"
#include "tools/report/content/own_match.hpp"
#include "tools/shared/matching/named_models.hpp"
#include "tools/shared/views/views.hpp"

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
  if (options.model_files.size() > 1)
    throw Error(Status::bad_config, options.recording.string() + ": was matched with one model; give --model once");
  if (!options.model_files.empty()) return options.model_files.front();
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

/// Those that are given, or all that the recording names, as it names them.
std::vector<NamedModel> models_of_components(const ReportOptions& options,
                                             const std::vector<ComponentSettings>& recorded) {
  std::vector<std::string> files = options.model_files;
  if (files.empty())
    for (const ComponentSettings& component : recorded) files.push_back(component.model_file);
  std::vector<NamedModel> models = open_models(files);
  for (NamedModel& named : models)
    named.name = component_with(recorded, named.model.checksum(), named.file, options.recording.string()).name;
  return models;
}

void require_content(const RecordingContent& content) {
  if (content.audit.frames > 0 || content.audit.results > 0) return;
  const auto flaws = content.audit.flaws();
  throw Error(Status::bad_input, content.file.string() + ": contains no frame and no result" +
                                     (flaws.empty() ? "" : " (" + flaws.front() + ")") + "; see lbea-inspect");
}

/// Of the tests that all components have.
std::optional<std::size_t> place_of(const ReportOptions& options, std::span<const TestReport> components) {
  const std::vector<RecordedTest>& tests = components.front().content.tests;
  if (options.test) {
    if (*options.test == 0 || *options.test > tests.size())
      throw Error(Status::bad_config, "--test " + std::to_string(*options.test) + ": the recording has " +
                                          std::to_string(tests.size()) + " tests with matched frames");
    return *options.test - 1;
  }
  std::optional<std::size_t> longest;
  std::uint64_t most = 0;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    std::uint64_t matched = 0;
    for (const TestReport& report : components) matched += report.content.tests[i].record.answer().matched();
    if (!longest || matched > most) longest = i, most = matched;
  }
  return longest;
}

/// The baked images' limits hold for frames from their pose; for others, and of a component between others, the matcher
/// has rendered images.
void find_limits(TestReport& report) {
  if (!report.component.empty()) return;
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
                            report.content.component, stage(progress, "reading frames"));
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
  if (facts.record != nullptr && facts.record->latest() && !facts.record->latest()->matches.empty()) {
    const std::uint32_t simulation = facts.record->latest()->matches.front().sample.simulation;
    if (const std::string lost = lost_elements_sentence(report.model, simulation); !lost.empty())
      report.explanation.meaning += " " + lost;
  }
  if (facts.record != nullptr) report.warnings = facts.record->answer().warnings();
  if (audit.counters && audit.counters->interleaved > 0)
    report.warnings.push_back("the frames of different senders alternate: they are not one test");
  if (!report.warnings.empty() && report.explanation.tone == Explanation::Tone::good) add_doubt(report.explanation);
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

namespace {

TestReport begin_report(RecordingContent content, Model model, const std::filesystem::path& file,
                        const ReportOptions& options) {
  TestReport report(std::move(content), std::move(model), file);
  report.names = simulation_names(report.model);
  find_poses(report, options);
  return report;
}

void complete(TestReport& report, std::optional<std::size_t> test, const StageReporter& progress) {
  if (test && report.content.tests[*test].record.latest()) report.test = test;
  find_limits(report);
  study_frames(report, progress);
  if (report.record() != nullptr) {
    report.channels = study_channels(report.model, *report.record(), require_not_stopped);
    report.fields = compare_fields(report.model, report.frames, report.channels, is_explained(report));
  }
  explain(report);
}

std::vector<TestReport> reports_of_components(const ReportOptions& options,
                                              const std::vector<ComponentSettings>& recorded, std::size_t rows,
                                              const StageReporter& progress) {
  const std::vector<NamedModel> models = models_of_components(options, recorded);
  std::vector<std::uint64_t> checksums;
  for (const NamedModel& named : models) checksums.push_back(named.model.checksum());
  std::vector<RecordingContent> contents =
      read_components(options.recording, checksums, stage(progress, "reading results"), rows);
  std::vector<TestReport> reports;
  for (std::size_t i = 0; i < models.size(); ++i) {
    reports.push_back(begin_report(std::move(contents[i]), models[i].model, models[i].file, options));
    reports.back().component = models[i].name;
  }
  if (reports.front().content.audit.results == 0)
    throw Error(Status::bad_input, options.recording.string() +
                                       ": has no results of its components; match it with lbea-replay --model, once "
                                       "for each");
  return reports;
}

}  // namespace

std::vector<TestReport> make_reports(const ReportOptions& options, const StageReporter& progress) {
  const std::size_t rows =
      options.keeps_all_frames ? std::numeric_limits<std::size_t>::max() : TestRecord::default_capacity;
  RecordingContent content = read_recording(options.recording, stage(progress, "reading results"), rows);
  require_content(content);
  std::vector<TestReport> reports;
  if (const auto& recorded = content.audit.settings.components; !recorded.empty()) {
    reports = reports_of_components(options, recorded, rows, progress);
  } else {
    const std::filesystem::path file = model_file_of(options, content);
    Model model = open_model(file, content);
    reports.push_back(begin_report(std::move(content), std::move(model), file, options));
    if (reports.front().content.audit.results == 0) match_frames(reports.front(), options, stage(progress, "matching"));
  }
  const std::optional<std::size_t> test = place_of(options, reports);
  for (TestReport& report : reports) complete(report, test, progress);
  return reports;
}

}  // namespace lbea::tool
