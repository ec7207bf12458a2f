#include "tools/replay/replay_settings.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "tools/replay/report.hpp"
#include "tools/shared/answer/test_answer.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/matching/named_models.hpp"
#include "tools/shared/replaying/component_replay.hpp"
#include "tools/shared/replaying/rig_replay.hpp"
#include "tools/shared/text/printable.hpp"
#include "tools/shared/views/assembled_views.hpp"
#include "tools/shared/views/views.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

namespace lbea::tool {
namespace {

constexpr std::uint64_t most_differences_shown = 20;

/// Prints, writes or compares each new result.
class ResultOutput {
 public:
  ResultOutput(const ModelReplayOptions& options, const RunSettings& settings,
               const std::vector<ComponentModel>& components, ResultComparison* comparison)
      : options_(options), components_(components), comparison_(comparison), answers_(components.size()) {
    if (!options.output.empty()) file_ = std::make_unique<ResultsFile>(options.output, settings);
    if (comparison == nullptr && !options.json && options.output.empty()) std::printf("%s\n", result_header().c_str());
  }
  bool operator()(const wire::WireResult& result, const TestKey& test) {
    ++counters_.by_status[static_cast<std::size_t>(result.status)];
    if (test != std::exchange(test_, test)) print_answers();
    for (std::size_t i = 0; i < components_.size(); ++i)
      if (result.component.empty() || result.component == components_[i].name) answers_[i].add(result);
    if (file_) file_->add(result);
    if (comparison_ != nullptr) {
      compare(result);
    } else if (options_.output.empty()) {
      std::printf("%s\n", (options_.json ? result_json(result) : printable(result_line(result))).c_str());
    }
    return stop_requested == 0;
  }
  /// Throws Error{bad_input} when no frame was matched and nothing is compared.
  void finish() {
    print_answers();
    if (file_) file_->finish();
    const std::string refusal = refusal_of_all(counters_, components_.front().model.length_unit());
    if (!refusal.empty() && comparison_ == nullptr)
      throw Error(Status::bad_input, options_.settings.recording + ": " + refusal);
  }

 private:
  /// Of the test that ends.
  void print_answers() {
    for (std::size_t i = 0; i < components_.size(); ++i) print_answer(components_[i], answers_[i]);
    answers_.assign(components_.size(), {});
  }
  void print_answer(const ComponentModel& component, const TestAnswer& answer) const {
    const std::vector<std::string> names = simulation_names(component.model);
    const std::string of = components_.size() > 1 ? ", " + component.name : "";
    if (answer.state().frames > 0 && comparison_ == nullptr && !options_.json)
      std::printf("test%s: %s\n", printable(of).c_str(), printable(answer_text(answer.state(), names)).c_str());
    const std::string prefix = components_.size() > 1 ? component.name + ": " : "";
    if (const std::string warning = answer.warning(); !warning.empty()) log_warning("{}{}", prefix, warning);
  }
  void compare(const wire::WireResult& result) {
    const auto difference = comparison_->compare(result);
    if (difference && shown_++ < most_differences_shown && !options_.json)
      std::printf("%s\n", printable(*difference).c_str());
  }
  const ModelReplayOptions& options_;
  const std::vector<ComponentModel>& components_;
  ResultComparison* comparison_;
  wire::Counters counters_;
  std::vector<TestAnswer> answers_;  // of each component
  TestKey test_;
  std::unique_ptr<ResultsFile> file_;
  std::uint64_t shown_ = 0;
};

/// Matches the frames of the part and, before them, those of the same test, on which its first results depend. Frames
/// that the matcher dropped would change the results of the others. False when stopped.
template <class Replay>
bool match_part(RecordedRun& run, const Part& part, std::int64_t history_ns, const FrameFates& fates, Replay& replay,
                const ResultHandler& handle, std::uint64_t& dropped) {
  run.limit(Part{}.from_ns, part.to_ns);
  run.rewind();
  while (const auto message = run.next()) {
    if (stop_requested != 0) return false;
    if (message->kind != RecordedMessage::Kind::frame) continue;
    const FrameKey frame{message->session, message->id};
    const bool is_wanted = message->log_time_ns >= part.from_ns;
    if (fates.was_dropped(frame)) {
      if (is_wanted) ++dropped;
    } else if (message->log_time_ns < history_ns) {
      replay.skip(*message);
    } else if (!replay.add({*message, fates.test_of(frame), is_wanted}, handle)) {
      return false;
    }
  }
  if constexpr (requires { replay.flush(handle); }) return replay.flush(handle);
  return true;
}

std::vector<SensorViews> views_of_rigs(const RunSettings& settings, const Model& model,
                                       const SettingsOptions& options) {
  std::vector<SensorViews> views;
  for (std::size_t i = 0; i < settings.rigs.size(); ++i) {
    const RigSettings& rig = settings.rigs[i];
    MatcherConfig config = settings.matcher;
    config.T_reference_sensor = rig.T_reference_sensor;
    const std::string file = options.rig_pose_files[i].empty()
                                 ? options.recording + " (sensor.json of rig " + rig.name + ")"
                                 : options.rig_pose_files[i];
    views.push_back(views_for(config, model, rig.sensor_json, file));
  }
  return views;
}

/// Throws Error{bad_input} where only a matcher could tell which frames were captured together.
void require_captures(const RunSettings& settings, const FrameFates& fates, const std::string& file) {
  if (!settings.rigs.empty() && fates.captures().empty())
    throw Error(Status::bad_input,
                file +
                    ": has frames of several rigs, and no results that say which were captured together; send them "
                    "to lbea-serve with --to NAME=ENDPOINT for each rig, and record them there with their results");
}

/// The same for several rigs. Matches all captures up to the part's end.
bool match_captures(RecordedRun& run, const Part& part, RigReplay& replay, const ResultHandler& handle) {
  run.limit(Part{}.from_ns, part.to_ns);
  run.rewind();
  while (const auto message = run.next()) {
    if (stop_requested != 0) return false;
    if (message->kind == RecordedMessage::Kind::frame && !replay.add(*message, part.from_ns, handle)) return false;
  }
  return true;
}

void warn_of_gaps(const ComparisonTally& tally, const std::string& file) {
  if (tally.edge_frames + tally.edge_results > 0)
    log_warning(
        "{} starts or ends between frames and their results: {} frames without a result and {} results without a frame "
        "are not compared",
        file, tally.edge_frames, tally.edge_results);
  if (tally.without_history > 0)
    log_warning("{}: the test began before the recording; {} results depend on earlier frames and are not compared",
                file, tally.without_history);
}

[[noreturn]] void report_nothing_compared(const ComparisonTally& tally, const std::string& file) {
  throw Error(Status::bad_input,
              file + ": nothing was compared, because " +
                  (tally.without_history > 0
                       ? "its results depend on frames before the recording; start recording before the test"
                       : "no frame is recorded with its result; see lbea-inspect"));
}

bool conclude(ComparisonTally tally, const Part& part, const ModelReplayOptions& options) {
  const std::string& file = options.settings.recording;
  if (!part.is_whole) tally.not_repeated = tally.edge_results = 0;  // from other frames
  warn_of_gaps(tally, file);
  std::printf("%s\n", (options.json ? comparison_json(tally) : comparison_line(tally)).c_str());
  if (tally.compared() == 0) report_nothing_compared(tally, file);
  return tally.is_same();
}

/// The models of --model, in the order of the recorded components. Throws Error{bad_config} when they are others.
std::vector<ComponentModel> open_components(const std::vector<ComponentSettings>& recorded,
                                            const ModelReplayOptions& options) {
  std::vector<ComponentModel> given, ordered;
  for (const std::string& file : options.model_files) given.push_back({component_name(file), Model::open(file)});
  if (recorded.empty() && given.size() == 1) return given;
  std::string names;
  for (const ComponentSettings& component : recorded) {
    names += (names.empty() ? "" : ", ") + component.name;
    const auto found = std::ranges::find(given, component.name, &ComponentModel::name);
    if (found == given.end()) continue;
    ordered.push_back(*found);
    if (ordered.size() > 1 && component.model_checksum != found->model.checksum())
      log_warning("component {} was matched with another model than the one given (then {})", component.name,
                  component.model_file);
  }
  if (ordered.size() != recorded.size() || ordered.size() != given.size())
    throw Error(Status::bad_config, options.settings.recording + ": was matched with " +
                                        (names.empty() ? "one model" : "the models of the components " + names) +
                                        "; give --model once for each, with files of these names");
  return ordered;
}

/// An upper bound: a recording may claim any --max-points, for which a matcher allocates memory.
std::uint32_t most_points(const FrameFates& fates) {
  constexpr std::size_t least_bytes = 3;  // of a point
  return static_cast<std::uint32_t>(std::max<std::size_t>(fates.most_bytes() / least_bytes, 1));
}

bool match_components(RecordedRun& run, const Part& part, const ModelReplayOptions& options, RunSettings settings,
                      std::vector<ComponentModel>& components, const FrameFates& fates, const ResultHandler& handle,
                      std::uint64_t& dropped) {
  settings.matcher.max_points = std::min(settings.matcher.max_points, most_points(fates));
  if (settings.matcher.method == Method::fit) log_info("tracked: {}", coupling_text(components));
  const std::string& pose_file = options.settings.pose_file;
  complete_views(components, settings.matcher, settings.sensor_json,
                 pose_file.empty() ? options.settings.recording + " (sensor.json)" : pose_file);
  ComponentReplay replay(components, settings, options.threads);
  const std::int64_t history_ns = has_history(settings) ? history_of(run, part, fates) : part.from_ns;
  return match_part(run, part, history_ns, fates, replay, handle, dropped);
}

/// False when stopped.
bool match_again(RecordedRun& run, const Part& part, const ModelReplayOptions& options, const RunSettings& settings,
                 std::vector<ComponentModel>& components, const FrameFates& fates, const ResultHandler& handle,
                 std::uint64_t& dropped) {
  if (components.size() > 1) return match_components(run, part, options, settings, components, fates, handle, dropped);
  const Model& model = components.front().model;
  const std::string &recording = options.settings.recording, &pose_file = options.settings.pose_file;
  if (!settings.rigs.empty()) {
    const std::vector<SensorViews> views = views_of_rigs(settings, model, options.settings);
    RigReplay replay(model, settings, views, fates, options.threads);
    const bool is_done = match_captures(run, part, replay, handle);
    dropped = replay.left_out();
    return is_done;
  }
  if (!pose_file.empty()) (void)io::read_pose(pose_file, model.length_unit());
  const SensorViews views = views_for(settings.matcher, model, settings.sensor_json,
                                      pose_file.empty() ? recording + " (sensor.json)" : pose_file);
  MatchReplay replay(model, settings, views, has_history(settings) ? 1 : options.threads);
  const std::int64_t history_ns = has_history(settings) ? history_of(run, part, fates) : part.from_ns;
  return match_part(run, part, history_ns, fates, replay, handle, dropped);
}

}  // namespace

bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options) {
  std::vector<ComponentModel> components =
      open_components(recorded_components(run.settings(), options.settings.recording), options);
  const FrameFates fates(run);
  require_captures(run.settings(), fates, options.settings.recording);
  RunSettings settings = replay_settings(run.settings(), components.front().model, options.settings);
  settings.program = "lbea-replay " LBEA_VERSION_STRING;
  std::optional<ResultComparison> comparison;
  if (options.compares) comparison.emplace(run, fates, options.tolerance, has_history(settings));
  ResultComparison* const compared = comparison ? &*comparison : nullptr;
  ResultOutput output(options, settings, components, compared);
  const ResultHandler handle = [&](const wire::WireResult& result, const TestKey& test) {
    return output(result, test);
  };
  std::uint64_t dropped = 0;
  if (!match_again(run, part, options, settings, components, fates, handle, dropped)) return false;
  if (dropped > 0) log_info("{} recorded frames did not get into the matcher and are not matched", dropped);
  output.finish();
  return !comparison || conclude(comparison->tally(), part, options);
}

}  // namespace lbea::tool
