// lbea-record: records frames without a matcher, or between a rig and its matcher.
#include "tools/record/frame_recorder.hpp"
#include "tools/shared/cli/outlet.hpp"
#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/recording/recording_options.hpp"

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

struct Options {
  std::string frames_endpoint, forward_endpoint, results_endpoint;
  RecordingOptions recording;
  ServerAccessOptions server_access;
  ClientAccessOptions matcher_access;
  std::uint32_t max_points = wire::WireLimits{}.max_points;
  bool json = false;
};

constexpr auto description =
    "Records the frames of a rig. With --forward it also forwards everything to a matcher: the rig then sends to this\n"
    "program. Where lbea-serve runs, its own --record is simpler.\n"
    "Recording never waits for the matcher: a frame without room there is recorded and counted as refused.\n"
    "The exit code is 1 when a frame could not be recorded, had no room at the matcher, or did not arrive, and when a\n"
    "sender stopped without goodbye.";

void add_options(Tool& tool, Options& options) {
  tool.add_option("FILE", options.recording.file,
                  "the recording (MCAP), which must not exist yet; its name may contain the time of the start in "
                  "strftime's notation: %Y-%m-%d_%H-%M-%S.mcap")
      ->required()
      ->transform(recording_name());
  tool.add_option("--frames", options.frames_endpoint, "endpoint to receive frames on, e.g. ipc:///tmp/rig.ipc")
      ->required()
      ->check(not_empty());
  tool.add_option("--forward", options.forward_endpoint, "endpoint of a matcher's frames, to forward to")
      ->check(not_empty());
  tool.add_option("--results", options.results_endpoint, "endpoint of a matcher's results, to record as well")
      ->check(not_empty());
  add_recording_options(tool, options.recording);
  const auto set_trigger = [&](std::int64_t stamp_ns) { options.recording.trigger_ns = stamp_ns; };
  tool.add_option_function("--trigger-ns", set_trigger, "the sender's clock at impact")->default_text("0");
  tool.add_option("--max-points", options.max_points,
                  "the limit of a matcher of this recording; larger frames are recorded too, counted and logged")
      ->check(in_range(1u, wire::WireLimits::most_points));
  options.server_access.add_to(tool);
  auto* server_key = tool.add_option("--server-key", options.matcher_access.server_key_file,
                                     "public key (.pub) of the matcher, if it has one: for --forward and --results")
                         ->check(not_empty());
  tool.add_option("--client-key", options.matcher_access.key_file,
                  "this program's secret key (.key) for the matcher, which must allow it")
      ->needs(server_key)
      ->check(not_empty());
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
  tool.add_usage_check([&options] {
    const bool has_matcher = !options.forward_endpoint.empty() || !options.results_endpoint.empty();
    if (!options.matcher_access.server_key_file.empty() && !has_matcher)
      throw WrongUsage("--server-key: is for --forward and --results, and neither is given");
  });
}

RunSettings settings_of(const Options& options) {
  RunSettings settings;
  settings.program = "lbea-record " LBEA_VERSION_STRING;
  settings.matcher.trigger_ns = options.recording.trigger_ns.value_or(0);
  settings.matcher.max_points = options.max_points;
  settings.start_ns = wire::wall_clock_ns();
  return settings;
}

void print(const RecordTally& tally, const RunObserver::Counts& counts, bool as_json) {
  const nlohmann::ordered_json json{{"received", tally.received},
                                    {"recorded", counts.recorded},
                                    {"unrecorded", counts.unrecorded},
                                    {"damaged", tally.damaged},
                                    {"too_many_points", tally.too_many_points},
                                    {"forwarded", tally.forwarded},
                                    {"refused", tally.refused},
                                    {"missed", tally.missed},
                                    {"withheld", tally.withheld},
                                    {"silent", tally.silent},
                                    {"interleaved", tally.interleaved},
                                    {"lost_results", tally.lost_results}};
  std::string line;
  for (const auto& [key, value] : json.items()) line += (line.empty() ? "" : ", ") + key + " " + value.dump();
  wait_for_log();
  print_last_line(as_json ? json.dump() : line);
}

/// Logs what is missing from the recording, and what the matcher did not get.
void warn_of_losses(const std::string& file, const RecordTally& tally) {
  std::string losses;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) losses += (losses.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(tally.missed - tally.withheld, "captures that never arrived (missed)");
  add(tally.withheld, "captures without room at their sender (withheld)");
  add(tally.damaged, "messages without a whole point cloud (damaged)");
  add(tally.silent, "senders that stopped without goodbye (their withheld captures are unknown)");
  add(tally.lost_results, "results and states of the matcher");
  if (!losses.empty()) spdlog::warn("{} is incomplete; missing: {}", file, losses);
  if (tally.refused > 0)
    spdlog::warn("the matcher did not get {} of {} frames; they are recorded", tally.refused, tally.received);
  if (tally.unforwarded_controls > 0)
    spdlog::warn("the senders' last control messages did not reach the matcher; its account ends before them");
}

int record(const Options& options) {
  const Log log("lbea-record");
  catch_stop_signals();
  catch_trigger_signal();
  require_distinct_endpoints({{"--frames", options.frames_endpoint},
                              {"--forward", options.forward_endpoint},
                              {"--results", options.results_endpoint}});
  wire::WireContext context;
  wire::WireLimits limits;
  limits.max_points = options.max_points;
  const wire::ClientAccess matcher_access = options.matcher_access.load();
  wire::FrameSource frames(context, options.frames_endpoint, limits, options.server_access.load());
  std::optional<wire::FrameSink> forward;
  std::optional<wire::ResultSource> results;
  if (!options.forward_endpoint.empty())
    forward.emplace(context, options.forward_endpoint, wire::default_queued_messages, matcher_access);
  if (!options.results_endpoint.empty())
    results.emplace(context, options.results_endpoint, wire::results_held, matcher_access);
  const auto recorder = begin_recording(options.recording, settings_of(options));
  RecordingLog watch(recorder.get(), options.recording.file);
  spdlog::info("ready: frames on {}", frames.endpoint());
  warn_of_unbounded_peers();
  FrameRecorder frame_recorder(std::move(frames), std::move(forward), std::move(results), *recorder, limits);
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    watch.poll();
    frame_recorder.write_log();
  }
  frame_recorder.stop();
  frame_recorder.write_log();
  const RecordTally tally = frame_recorder.tally();
  recorder->set_senders(frame_recorder.senders(), tally.interleaved);
  const bool all_recorded = watch.finish();
  warn_of_unfinished(frame_recorder.senders());
  warn_of_losses(options.recording.file, tally);
  print(tally, recorder->counts(), options.json);
  return all_recorded && tally.is_complete() ? exit_ok : exit_failed;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool("lbea-record", lbea::tool::description,
                        "lbea-record test.mcap --frames ipc:///tmp/rig.ipc --forward ipc:///tmp/frames.ipc");
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::record(options); });
}
