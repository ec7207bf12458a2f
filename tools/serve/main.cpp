// lbea-serve: takes frames from a socket, matches each one, publishes the results.
#include "adapters/sensor/sensor_json.hpp"
#include "adapters/file/atomic_file.hpp"
#include "tools/common/access_options.hpp"
#include "tools/common/tool.hpp"
#include "tools/recording/recording_options.hpp"
#include "tools/serve/model_engine.hpp"
#include "tools/serve/pipeline.hpp"
#include "tools/serve/preview.hpp"
#include "tools/serve/run_observers.hpp"
#include "tools/serve/tally.hpp"
#include "tools/serve/views.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>

#include <unistd.h>

namespace lbea {

namespace {

struct Options {
  std::string model_file, frames_endpoint, results_endpoint, preview_endpoint, pose_file;
  MatcherConfig matcher;
  PipelineConfig pipeline;
  RecordingOptions recording;
  ServerAccessOptions access;
  bool json = false;
};

constexpr auto description =
    "Matches frames as they come in and publishes a result for each.\n"
    "Frames that find no free slot are dropped, counted, and reported as results. The exit code is 1 when any\n"
    "frame was dropped, when ids are missing between those received, when something could not be recorded, or\n"
    "when the tally does not add up.";

const std::map<std::string, Method> method_names{{"lbea", Method::lbea}, {"vtp", Method::vtp}, {"fit", Method::fit}};

void add_matching_options(Tool& tool, Options& options) {
  MatcherConfig& matcher = options.matcher;
  tool.add_option("--method", matcher.method, "fit: by what the sensor would see, with a verdict, an estimate between the samples and the test's history; "
                  "lbea: in the eigenbasis (eq. 3); vtp: by positions (eq. 1)")
      ->transform(CLI::CheckedTransformer(method_names))
      ->default_str("lbea");
  tool.add_option("--pose", options.pose_file,
                  "sensor.json with T_reference_sensor; without it frames are taken as they are. With fit, the whole rig: when "
                  "the model was not baked for this pose, its samples are rendered anew at the start")
      ->check(CLI::ExistingFile);
  tool.add_option("--trigger-ns", matcher.trigger_ns, "the sender's clock at impact");
  tool.add_option("--max-points", matcher.max_points, "larger frames are refused")
      ->check(CLI::Range(1u, 16'777'216u));
  tool.add_option("--matches", matcher.max_matches, "samples per result, nearest first")
      ->check(CLI::Range(1u, 1000u));
  tool.add_option("--trusted-distance", matcher.trusted_distance,
                  "a vertex counts as seen when a point lies this near, mm")
      ->check(CLI::PositiveNumber);
  tool.add_option("--min-coverage", matcher.min_coverage,
                  "share of the surface seen below which a match is not trusted")
      ->check(CLI::Range(0.0f, 1.0f));
}

void add_options(Tool& tool, Options& options) {
  tool.add_option("model", options.model_file, "baked model (.lbea)")->required();
  tool.add_option("--frames", options.frames_endpoint,
                  "endpoint to take frames from, e.g. ipc:///tmp/frames.ipc")
      ->required();
  tool.add_option("--results", options.results_endpoint,
                  "endpoint to publish results on, e.g. tcp://127.0.0.1:5556")
      ->required();
  tool.add_option("--preview", options.preview_endpoint,
                  "endpoint to publish thinned clouds on, at most 30 a second, for lbea-monitor, e.g. ipc:///tmp/preview.ipc");
  add_matching_options(tool, options);
  tool.add_option("--queue", options.pipeline.queue_slots, "frames that may wait for the matcher")
      ->check(CLI::Range(1u, 4096u));
  tool.add_option("--record", options.recording.file, "record all frames and results to this file (MCAP)");
  add_recording_options(tool, options.recording);
  options.access.add_to(tool);
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
}

std::string name_of(Method method) {
  for (const auto& [name, value] : method_names)
    if (value == method) return name;
  return "unknown";
}

PipelineConfig pipeline_config(const Options& options, const Model& model) {
  PipelineConfig config = options.pipeline;
  config.limits.max_points = options.matcher.max_points;
  config.max_matches = options.matcher.max_matches;
  config.description.version = LBEA_VERSION_STRING;
  config.description.method = name_of(options.matcher.method);
  config.description.model = summarize(model, options.model_file);
  return config;
}

/// For whoever replays the recording.
RunSettings run_settings(const Options& options, const Model& model) {
  RunSettings settings{"lbea-serve " LBEA_VERSION_STRING, options.model_file, model.checksum(), name_of(options.matcher.method), options.matcher, "", 0};
  if (!options.pose_file.empty()) settings.sensor_json = as_text(read_file(options.pose_file));
  settings.start_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  return settings;
}

/// Every waiting frame has a slot for max_points, allocated at the start.
void check_memory(const Options& options) {
  const auto pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
  const std::uint64_t installed = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
  const std::uint64_t needed = std::uint64_t{options.pipeline.queue_slots} * options.matcher.max_points * sizeof(Point);
  if (needed > installed / 2)
    throw Error(Status::bad_config, fmt::format("--queue {} frames of --max-points {} need {} MB, more than half of this machine's {} MB; "
                                                "lower one of them",
                                                options.pipeline.queue_slots, options.matcher.max_points, needed >> 20, installed >> 20));
}

int serve(Options options) {
  catch_stop_signals();
  if (!options.pose_file.empty()) options.matcher.T_reference_sensor = read_pose(options.pose_file);
  const Model model = Model::open(options.model_file);
  check_memory(options);
  ModelEngine engine(model, options.matcher, views_for(options.matcher, model, options.pose_file));
  WireContext context;
  PipelineConfig config = pipeline_config(options, model);
  const ServerAccess access = options.access.load();
  FrameSource frames(context, options.frames_endpoint, config.limits, access);
  ResultSink results(context, options.results_endpoint, results_held, access);
  const std::string ready = fmt::format("ready: frames on {}, results on {}, {} samples of {} simulations", frames.endpoint(),
                                        results.endpoint(), model.samples(), model.simulations());
  const auto recorder = begin_recording(options.recording, run_settings(options, model));
  RecordingWatch recording(recorder.get(), options.recording.file);
  RunObservers observers;
  observers.add(recorder.get());
  std::optional<Preview> preview;
  if (!options.preview_endpoint.empty())
    observers.add(&preview.emplace(context, options.preview_endpoint, PreviewConfig{config.limits, options.matcher.T_reference_sensor}));
  config.observer = &observers;
  Pipeline pipeline(config, engine, std::move(frames), std::move(results));
  spdlog::info(ready);
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    recording.look();
  }
  pipeline.stop();
  const bool all_recorded = recording.finish();
  const Counters counters = pipeline.counters();
  std::printf("%s\n", (options.json ? tally_json(counters) : tally_line(counters)).c_str());
  return is_complete(counters) && all_recorded ? exit_ok : exit_failed;
}

}  // namespace

}  // namespace lbea

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lbea-serve"));
  lbea::Options options;
  lbea::Tool tool("lbea-serve", lbea::description,
                  "lbea-serve rail.lbea --frames ipc:///tmp/frames.ipc --results tcp://127.0.0.1:5556 --pose "
                  "sensor.json");
  lbea::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::serve(options); });
}
