#include "tools/replay/model_replay.hpp"

#include "adapters/file/atomic_file.hpp"
#include "adapters/sensor/sensor_json.hpp"
#include "tools/common/tool.hpp"
#include "tools/replay/match_replay.hpp"
#include "tools/replay/report.hpp"
#include "tools/replay/results_file.hpp"
#include "tools/serve/views.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>

#include <unistd.h>

namespace lbea {

namespace {

constexpr std::uint64_t most_differences_shown = 20;

/// The recording's description of the rig as a file, for as long as it is needed.
class PoseFile {
 public:
  explicit PoseFile(const std::string& sensor_json) {
    if (sensor_json.empty()) return;
    path_ = std::filesystem::temp_directory_path() / ("lbea-replay-" + std::to_string(::getpid()) + "-sensor.json");
    AtomicFile file(path_);
    file.write(sensor_json);
    file.commit();
  }
  ~PoseFile() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
  }
  PoseFile(const PoseFile&) = delete;
  PoseFile& operator=(const PoseFile&) = delete;
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

RunSettings settings_for(const RecordedRun& run, const Model& model, const ModelReplayOptions& options) {
  RunSettings settings = run.settings();
  if (settings.model_checksum != 0 && settings.model_checksum != model.checksum())
    spdlog::info("{} is not the model it was recorded with ({})", options.model_file, settings.model_file);
  if (!options.pose_file.empty()) {
    settings.matcher.T_reference_sensor = read_pose(options.pose_file);
    settings.sensor_json = as_text(read_file(options.pose_file));
  }
  settings.program = "lbea-replay " LBEA_VERSION_STRING;
  settings.model_file = options.model_file;
  settings.model_checksum = model.checksum();
  return settings;
}

SensorViews views_of(const RunSettings& settings, const Model& model) {
  const PoseFile pose(settings.sensor_json);
  return views_for(settings.matcher, model, pose.path());
}

/// What becomes of each new result.
class Takers {
 public:
  Takers(const ModelReplayOptions& options, const RunSettings& settings, Comparison* comparison)
      : options_(options), comparison_(comparison) {
    if (!options.output.empty()) file_ = std::make_unique<ResultsFile>(options.output, settings);
    if (comparison == nullptr && !options.json && options.output.empty()) std::printf("%s\n", result_header().c_str());
  }
  bool operator()(const WireResult& result) {
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
  void compare(const WireResult& result) {
    const auto difference = comparison_->take(result);
    if (difference && shown_++ < most_differences_shown && !options_.json) std::printf("%s\n", difference->c_str());
  }
  const ModelReplayOptions& options_;
  Comparison* comparison_;
  std::unique_ptr<ResultsFile> file_;
  std::uint64_t shown_ = 0;
};

}  // namespace

bool replay_into_model(RecordedRun& run, const ModelReplayOptions& options) {
  const Model model = Model::open(options.model_file);
  const RunSettings settings = settings_for(run, model, options);
  std::optional<Comparison> comparison;
  if (options.compares) {
    RecordedRun whole(options.recording);  // results come later than their frames: not cut by a range
    comparison.emplace(whole, options.tolerance);
  }
  Takers takers(options, settings, comparison ? &*comparison : nullptr);
  MatchReplay replay(model, settings.matcher, views_of(settings, model), options.threads);
  const ResultTaker take = [&](const WireResult& result) { return takers(result); };
  bool goes_on = true;
  while (goes_on) {
    const auto message = run.next();
    if (!message) break;
    if (message->kind != RecordedMessage::Kind::frame) continue;
    if (comparison && comparison->was_dropped(message->session, message->id)) continue;
    goes_on = replay.add(*message, take);
  }
  if (!(goes_on && replay.flush(take))) return false;
  takers.finish();
  if (!comparison) return true;
  ComparisonTally tally = comparison->tally();
  if (options.is_part) tally.not_repeated = 0;
  std::printf("%s\n", (options.json ? comparison_json(tally) : comparison_line(tally)).c_str());
  return tally.is_same();
}

}  // namespace lbea
