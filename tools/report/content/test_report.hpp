// Everything that the page and the summary say about one test of a recording, or about one component in it.
#pragma once

#include "tools/report/content/accounts.hpp"
#include "tools/report/content/channels/channel_study.hpp"
#include "tools/report/content/comparison/field_comparison.hpp"
#include "tools/report/content/explanation.hpp"
#include "tools/report/content/forecast_study.hpp"

namespace lbea::tool {

struct ReportOptions {
  std::filesystem::path recording;
  std::vector<std::string> model_files;  // empty: those that the recording names
  std::string pose_file;                 // instead of the recorded pose
  bool without_pose = false;             // the points are in reference coordinates
  std::optional<std::size_t> test;       // its number, from 1; none: the one with the most matched frames
  bool keeps_all_frames = false;         // in the record, also of long tests
};

struct TestReport {
  TestReport(RecordingContent recording, Model baked, std::filesystem::path file)
      : content(std::move(recording)), model(std::move(baked)), model_file(std::move(file)) {}
  RecordingContent content;
  std::string component;  // of several; else empty
  Model model;
  std::filesystem::path model_file;
  std::vector<std::string> names;                               // of the simulations
  RigidTransform T_reference_sensor = identity_transform;       // of the points
  RigidTransform T_reference_view = identity_transform;         // of the pictures; the identity: unknown
  std::optional<std::size_t> test;                              // place in content.tests; none: no frame was matched
  double frame_limit = static_cast<double>(FrameRow::unknown);  // of the misfit; NaN: unknown
  double test_limit = static_cast<double>(FrameRow::unknown);
  FrameStudy frames;
  ForecastStudy forecasts;
  ChannelStudy channels;
  FieldComparison fields;
  RegionMap regions;
  Accounts accounts;
  bool is_own_match = false;  // the recording has no results, so its frames were matched for the report
  wire::Counters own_counters;
  std::map<CaptureKey, wire::WireResult> own_results;  // of the matched frames
  Explanation explanation;
  std::vector<std::string> warnings;  // as the log of lbea-serve gives them

  [[nodiscard]] const TestRecord* record() const noexcept { return test ? &content.tests[*test].record : nullptr; }
  [[nodiscard]] const wire::WireTestState& state() const noexcept;
  /// After the last frame.
  [[nodiscard]] const wire::WireForecast& forecast() const noexcept;
  /// Those of the model that the forecast has; 0 without a forecast.
  [[nodiscard]] std::uint32_t parameters() const noexcept {
    return std::min(model.parameters(), static_cast<std::uint32_t>(forecast().parameters.size()));
  }
  [[nodiscard]] const RunSettings& settings() const noexcept { return content.audit.settings; }
  [[nodiscard]] std::string length_unit() const { return std::string(model.length_unit()); }
};

/// Called with the name of a stage and its progress.
using StageReporter = std::function<void(std::string_view stage, std::uint64_t done, std::uint64_t total)>;

/// One, or one for each component, of the same test. Throws Error with a sentence when nothing can be told, and when
/// stopped.
[[nodiscard]] std::vector<TestReport> make_reports(const ReportOptions& options, const StageReporter& progress);
/// What the test says as a whole, by the explanations of its components.
[[nodiscard]] Explanation explain_together(std::span<const TestReport> components);

}  // namespace lbea::tool
