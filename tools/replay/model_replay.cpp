#include "tools/replay/model_replay.hpp"

#include "tools/replay/match_replay.hpp"
#include "tools/replay/report.hpp"
#include "tools/replay/results_file.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/views.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>

namespace lbea::tool {
namespace {

constexpr std::uint64_t most_differences_shown = 20;

/// What becomes of each new result.
class Takers {
 public:
  Takers(const ModelReplayOptions& options, const RunSettings& settings, Comparison* comparison)
      : options_(options), comparison_(comparison) {
    if (!options.output.empty()) file_ = std::make_unique<ResultsFile>(options.output, settings);
    if (comparison == nullptr && !options.json && options.output.empty()) std::printf("%s\n", result_header().c_str());
  }
  bool operator()(const wire::WireResult& result) {
    if (file_) file_->add(result);
    if (comparison_ != nullptr) {
      compare(result);
    } else if (options_.output.empty()) {
      std::printf("%s\n", (options_.json ? result_json(result) : result_line(result)).c_str());
    }
    return stop_requested == 0;
  }
  void finish() {
    if (file_) file_->finish();
  }

 private:
  void compare(const wire::WireResult& result) {
    const auto difference = comparison_->take(result);
    if (difference && shown_++ < most_differences_shown && !options_.json) std::printf("%s\n", difference->c_str());
  }
  const ModelReplayOptions& options_;
  Comparison* comparison_;
  std::unique_ptr<ResultsFile> file_;
  std::uint64_t shown_ = 0;
};

/// Matches the frames of the part, and before them those that its first results tell of: the test's history. False when
/// stopped.
bool match_part(RecordedRun& run, const Part& part, bool has_history, const Comparison* comparison, MatchReplay& replay,
                const ResultTaker& take) {
  const std::int64_t history_ns = has_history ? history_of(run, part) : part.from_ns;
  run.limit(Part{}.from_ns, part.to_ns);
  run.rewind();
  while (const auto message = run.next()) {
    if (stop_requested != 0) return false;
    if (message->kind != RecordedMessage::Kind::frame) continue;
    if (comparison != nullptr && comparison->was_dropped(message->session, message->id)) continue;
    if (message->log_time_ns < history_ns) {
      replay.pass_over(*message);
    } else if (!replay.add(*message, message->log_time_ns >= part.from_ns, take)) {
      return false;
    }
  }
  return replay.flush(take);
}

void explain(const ComparisonTally& tally, const std::string& file) {
  if (tally.edge_frames + tally.edge_results > 0)
    spdlog::warn(
        "{} begins or ends between frames and their results: {} frames there without a result and {} results without a "
        "frame are not compared",
        file, tally.edge_frames, tally.edge_results);
  if (tally.without_history > 0)
    spdlog::warn("{}: the test began before the recording; {} results are compared but for what the test adds up", file,
                 tally.without_history);
}

bool conclude(ComparisonTally tally, const Part& part, const ModelReplayOptions& options) {
  const std::string& file = options.settings.recording;
  if (!part.is_whole) tally.not_repeated = tally.edge_results = 0;  // of other frames
  explain(tally, file);
  std::printf("%s\n", (options.json ? comparison_json(tally) : comparison_line(tally)).c_str());
  if (tally.compared() == 0)
    throw Error(
        Status::bad_input,
        file + ": nothing was compared, as no frame is recorded with its result; lbea-inspect says what is recorded");
  return tally.is_same();
}

}  // namespace

bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options) {
  const Model model = Model::open(options.settings.model_file);
  const RunSettings settings = replay_settings(run.settings(), model, options.settings);
  std::optional<Comparison> comparison;
  if (options.compares) {
    run.rewind();  // results come later than their frames: not cut by a range
    comparison.emplace(run, options.tolerance);
  }
  Comparison* const compared = comparison ? &*comparison : nullptr;
  Takers takers(options, settings, compared);
  const std::string& pose_file = options.settings.pose_file;
  const SensorViews views = views_for(settings.matcher, model, settings.sensor_json,
                                      pose_file.empty() ? options.settings.recording + " (sensor.json)" : pose_file);
  MatchReplay replay(model, settings.matcher, views, options.threads);
  const ResultTaker take = [&](const wire::WireResult& result) { return takers(result); };
  if (!match_part(run, part, settings.matcher.method == Method::fit, compared, replay, take)) return false;
  takers.finish();
  return !comparison || conclude(comparison->tally(), part, options);
}

}  // namespace lbea::tool
