// lbea-replay: plays a recording to a matcher's socket, or straight into a model.
#include "tools/common/access_options.hpp"
#include "tools/common/tool.hpp"
#include "tools/replay/model_replay.hpp"
#include "tools/replay/report.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <charconv>
#include <cstdio>
#include <limits>

namespace lbea {

namespace {

using namespace std::chrono_literals;

struct Options {
  std::string file, endpoint, range;
  PaceConfig pace;
  bool fast = false, json = false;
  SocketReplayConfig socket;
  ModelReplayOptions model;
  ClientAccessOptions access;
};

constexpr auto description =
    "Plays a recording: with --to, its frames go to a matcher as a camera would send them, at the pace they came; with\n"
    "--model, straight into matchers of this model, set up as they were when it was recorded, as fast as it goes. The same\n"
    "recording and model give the same results, to the last bit, on any number of threads.\n"
    "The exit code is 1 when frames found no room at the receiver, and with --against when results differ.";
constexpr auto longest_wait = 5s;

void add_options(Tool& tool, Options& options) {
  tool.add_option("FILE", options.file, "the recording")->required();
  auto* to = tool.add_option("--to", options.endpoint, "endpoint of a matcher's frames, e.g. ipc:///tmp/frames.ipc");
  auto* model = tool.add_option("--model", options.model.model_file, "baked model (.lbea) to match with");
  to->excludes(model);
  auto* speed = tool.add_option("--speed", options.pace.speed, "times as fast as recorded")->check(CLI::Range(1e-3, 1e6));
  tool.add_flag("--fast", options.fast, "as fast as it goes; sending waits for room")->excludes(speed);
  tool.add_flag("--step", options.pace.steps, "one frame per line on standard input (Enter)")->excludes(speed);
  tool.add_option("--loop", options.socket.rounds, "with --to: how often to play it; 0: until stopped")
      ->check(CLI::Range(0, 1'000'000))
      ->excludes(model);
  tool.add_option("--range", options.range, "FROM:TO, seconds after the first frame; either may be left out");
  tool.add_flag("--end-of-stream,!--open-end", options.socket.ends_stream, "with --to: say after the last frame that the test is over");
  tool.add_option("--threads", options.model.threads, "with --model")->check(CLI::Range(1u, 256u));
  tool.add_option("--pose", options.model.pose_file, "with --model: another sensor.json than that of the recording")->check(CLI::ExistingFile);
  tool.add_option("-o,--output", options.model.output, "with --model: write the results to this file (MCAP)")->needs(model);
  tool.add_flag("--against", options.model.compares, "with --model: compare the results with those recorded")->needs(model);
  tool.add_option("--tolerance", options.model.tolerance,
                  "with --against: share by which best distance and coverage may differ; 0: everything is the same, to the bit")
      ->check(CLI::Range(0.0, 1.0));
  options.access.add_to(tool);
  tool.add_flag("--json", options.json, "print as JSON");
}

std::int64_t first_frame_ns(RecordedRun& run) {
  while (const auto message = run.next())
    if (message->kind == RecordedMessage::Kind::frame) return message->log_time_ns;
  return 0;
}

std::optional<double> seconds(std::string_view text, double if_empty) {
  if (text.empty()) return if_empty;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

void limit(RecordedRun& run, const std::string& range) {
  if (range.empty()) return;
  const auto colon = range.find(':');
  constexpr double longest_s = 4e9;
  const std::string_view text = range;
  const auto from = colon == std::string::npos ? std::nullopt : seconds(text.substr(0, colon), -longest_s);
  const auto to = colon == std::string::npos ? std::nullopt : seconds(text.substr(colon + 1), longest_s);
  if (!from || !to || !(std::abs(*from) <= longest_s) || !(std::abs(*to) <= longest_s))
    throw Error(Status::bad_config, "--range \"" + range + "\": not FROM:TO in seconds; write e.g. 0.5:2");
  const std::int64_t first = first_frame_ns(run);
  run.limit(first + static_cast<std::int64_t>(*from * 1e9), first + static_cast<std::int64_t>(*to * 1e9));
}

int send(Options options, RecordedRun& run) {
  WireContext context;
  FrameSink sink(context, options.endpoint, default_queued_messages, options.access.load());
  const auto deadline = std::chrono::steady_clock::now() + longest_wait;
  while (!sink.wait_ready(50ms))
    if (stop_requested != 0 || std::chrono::steady_clock::now() > deadline)
      throw Error(Status::endpoint_unavailable,
                  "endpoint \"" + options.endpoint + "\": nobody listens there; start lbea-serve with --frames " + options.endpoint);
  if (options.fast) options.pace.speed = 0;
  options.socket.waits = options.fast || options.pace.steps;
  const auto stop = [] { return stop_requested != 0; };
  Pace pace(options.pace, stop);
  const SocketReplayTally tally = replay_to_socket(run, options.socket, sink, pace, stop);
  const double late_ms = static_cast<double>(pace.worst_lateness().count()) * 1e-6;
  std::printf("%s\n", (options.json ? socket_json(tally, late_ms) : socket_line(tally, late_ms)).c_str());
  return tally.refused == 0 && tally.left == 0 && stop_requested == 0 ? exit_ok : exit_failed;
}

int replay(Options options) {
  catch_stop_signals();
  if (options.endpoint.empty() && options.model.model_file.empty())
    throw Error(Status::bad_config, "where to? Give --to ENDPOINT or --model MODEL");
  RecordedRun run(options.file);
  limit(run, options.range);
  run.rewind();
  if (!options.endpoint.empty()) return send(options, run);
  options.model.json = options.json;
  options.model.recording = options.file;
  options.model.is_part = !options.range.empty();
  return replay_into_model(run, options.model) ? exit_ok : exit_failed;
}

}  // namespace

}  // namespace lbea

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lbea-replay"));
  lbea::Options options;
  lbea::Tool tool("lbea-replay", lbea::description,
                  "lbea-replay test.mcap --to ipc:///tmp/frames.ipc\n  lbea-replay test.mcap --model rail.lbea --against");
  lbea::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::replay(options); });
}
