// lbea-record: records frames without a matcher, or on their way to one.
#include "tools/common/access_options.hpp"
#include "tools/common/distinct_endpoints.hpp"
#include "tools/common/wall_clock.hpp"
#include "tools/common/unfinished_senders.hpp"
#include "tools/record/frame_tap.hpp"
#include "tools/recording/recording_options.hpp"

#include <nlohmann/json.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>

namespace lbea {

namespace {

struct Options {
  std::string frames_endpoint, forward_endpoint, results_endpoint;
  RecordingOptions recording;
  ServerAccessOptions server_access;
  std::int64_t trigger_ns = 0;
  std::uint32_t max_points = WireLimits{}.max_points;
  bool json = false;
};

constexpr auto description =
    "Records frames that a rig sends, without a matcher, or with --forward on their way to one: then the rig sends here and\n"
    "this program passes everything on. Where lbea-serve runs, its own --record is the shorter way.\n"
    "The exit code is 1 when anything could not be recorded, found no room at the matcher, or did not arrive,\n"
    "and when a sender fell silent without goodbye.";

void add_options(Tool& tool, Options& options) {
  tool.add_option("FILE", options.recording.file, "the recording (MCAP), which must not exist yet")->required();
  tool.add_option("--frames", options.frames_endpoint, "endpoint to take frames from, e.g. ipc:///tmp/rig.ipc")->required();
  tool.add_option("--forward", options.forward_endpoint, "endpoint of a matcher's frames, to pass them on to");
  tool.add_option("--results", options.results_endpoint, "endpoint of a matcher's results, to record them too");
  add_recording_options(tool, options.recording);
  tool.add_option("--trigger-ns", options.trigger_ns, "the sender's clock at impact");
  tool.add_option("--max-points", options.max_points, "larger frames are not recorded, only counted")->check(CLI::Range(1u, 16'777'216u));
  options.server_access.add_to(tool);
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
}

RunSettings settings_of(const Options& options) {
  RunSettings settings;
  settings.program = "lbea-record " LBEA_VERSION_STRING;
  settings.matcher.trigger_ns = options.trigger_ns;
  settings.matcher.max_points = options.max_points;
  settings.start_ns = wall_clock_ns();
  return settings;
}

void print(const TapTally& tally, const RunObserver::Counts& counts, bool as_json) {
  const nlohmann::ordered_json json{{"received", tally.frames},     {"recorded", counts.recorded}, {"unrecorded", counts.unrecorded},
                                    {"damaged", tally.damaged},     {"forwarded", tally.forwarded}, {"refused", tally.refused},
                                    {"missed", tally.missed},       {"silent", tally.silent},
                                    {"lost_results", tally.lost_results}};
  std::string line;
  for (const auto& [key, value] : json.items()) line += (line.empty() ? "" : ", ") + key + " " + value.dump();
  std::printf("%s\n", (as_json ? json.dump() : line).c_str());
}

int record(const Options& options) {
  catch_stop_signals();
  require_distinct_endpoints({{"--frames", options.frames_endpoint}, {"--forward", options.forward_endpoint}, {"--results", options.results_endpoint}});
  WireContext context;
  WireLimits limits;
  limits.max_points = options.max_points;
  FrameSource frames(context, options.frames_endpoint, limits, options.server_access.load());
  std::optional<FrameSink> forward;
  std::optional<ResultSource> results;
  if (!options.forward_endpoint.empty()) forward.emplace(context, options.forward_endpoint);
  if (!options.results_endpoint.empty()) results.emplace(context, options.results_endpoint);
  const auto recorder = begin_recording(options.recording, settings_of(options));
  RecordingWatch watch(recorder.get(), options.recording.file);
  spdlog::info("ready: frames on {}", frames.endpoint());
  FrameTap tap(std::move(frames), std::move(forward), std::move(results), *recorder, limits);
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    watch.look();
  }
  tap.stop();
  const bool all_recorded = watch.finish();
  warn_of_unfinished(tap.senders());
  const TapTally tally = tap.tally();
  print(tally, recorder->counts(), options.json);
  return all_recorded && tally.damaged == 0 && tally.refused == 0 && tally.missed == 0 && tally.silent == 0 && tally.lost_results == 0 ? exit_ok : exit_failed;
}

}  // namespace

}  // namespace lbea

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lbea-record"));
  lbea::Options options;
  lbea::Tool tool("lbea-record", lbea::description, "lbea-record test.mcap --frames ipc:///tmp/rig.ipc --forward ipc:///tmp/frames.ipc");
  lbea::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::record(options); });
}
