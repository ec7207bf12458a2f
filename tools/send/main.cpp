// lbea-send: plays point clouds from files to a matcher, as a camera would.
#include "tools/common/progress.hpp"
#include "tools/common/tool.hpp"
#include "tools/send/player.hpp"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <random>

namespace lbea {

namespace {

struct Options {
  std::vector<std::string> paths;
  std::string endpoint, frame_id = "sensor";
  double rate_hz = 0;
  bool realtime = false, wait_ready = false, json = false;
  PlayConfig play;
};

constexpr auto description =
    "Sends point clouds (PLY, XYZ) as frames. All clouds are read and encoded before the first one leaves.\n"
    "With --rate or --realtime a frame that finds no room at the receiver is refused and counted, as a camera\n"
    "cannot wait; without, sending waits. The exit code is 1 when a frame was refused or did not leave here.";
constexpr auto longest_wait = std::chrono::milliseconds(5000);

void add_options(Tool& tool, Options& options) {
  tool.add_option("paths", options.paths, "files, or folders of them, which are taken by name")->required();
  tool.add_option("--to", options.endpoint, "endpoint of the matcher's frames, e.g. ipc:///tmp/frames.ipc")
      ->required();
  auto* rate = tool.add_option("--rate", options.rate_hz, "frames per second")->check(CLI::Range(1e-3, 1e6));
  tool.add_flag("--realtime", options.realtime, "pace by the clouds' stamps")->excludes(rate);
  tool.add_option("--loop", options.play.rounds, "how often to send all of them; 0: until stopped")
      ->check(CLI::Range(0, 1'000'000));
  tool.add_option("--frame-id", options.frame_id, "name of the coordinate system the points are in");
  tool.add_flag("--end-of-stream,!--open-end", options.play.ends_stream,
                "say after the last frame that the test is over");
  tool.add_flag("--wait-ready", options.wait_ready,
                "wait for the receiver as long as it takes, not just 5 s");
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
}

std::uint64_t new_session() {
  std::random_device random;
  return (std::uint64_t{random()} << 32) | random();
}

void wait_for_receiver(FrameSink& sink, const Options& options) {
  const auto deadline = std::chrono::steady_clock::now() + longest_wait;
  while (stop_requested == 0 && !sink.wait_ready(std::chrono::milliseconds(50))) {
    if (options.wait_ready || std::chrono::steady_clock::now() < deadline) continue;
    throw Error{Status::endpoint_unavailable,
                "endpoint \"" + options.endpoint +
                    "\": nobody listens there; start lbea-serve with --frames " + options.endpoint +
                    ", or use --wait-ready"};
  }
}

std::string tally_json(const PlayTally& tally) {
  return nlohmann::ordered_json{{"captured", tally.captured},
                                {"sent", tally.sent},
                                {"refused", tally.refused},
                                {"handed_over", tally.handed_over},
                                {"seconds", tally.seconds}}
      .dump();
}

std::string tally_line(const PlayTally& tally) {
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.3f", tally.seconds);
  return "captured " + std::to_string(tally.captured) + " = sent " + std::to_string(tally.sent) +
         " + refused " + std::to_string(tally.refused) + "; handed over " +
         std::to_string(tally.handed_over) + " in " + seconds + " s";
}

std::vector<EncodedCloud> load(const Options& options) {
  const auto files = find_clouds(options.paths);
  Progress progress("reading", files.size());
  return encode_clouds(files, options.play.session, options.frame_id,
                       [&](std::size_t done) { progress.advance_to(done); });
}

int send(Options options) {
  catch_stop_signals();
  options.play.session = new_session();
  WireContext context;
  FrameSink sink(context, options.endpoint);
  const auto clouds = load(options);
  if (options.realtime) options.play.due_ns = schedule_by_stamps(clouds);
  if (options.rate_hz > 0) options.play.due_ns = schedule_by_rate(clouds.size(), options.rate_hz);
  wait_for_receiver(sink, options);
  const std::uint64_t planned = options.play.rounds * clouds.size();
  PlayTally tally;
  {
    Progress progress("sending", planned);
    tally = play(
        clouds, options.play, sink, [] { return stop_requested != 0; },
        [&](std::uint64_t done) { progress.advance_to(done); });
  }
  std::printf("%s\n", (options.json ? tally_json(tally) : tally_line(tally)).c_str());
  return tally.handed_over == tally.captured && tally.captured >= planned ? exit_ok : exit_failed;
}

}  // namespace

}  // namespace lbea

int main(int argc, char** argv) {
  lbea::Options options;
  lbea::Tool tool("lbea-send", lbea::description,
                  "lbea-send frames/ --to ipc:///tmp/frames.ipc --rate 1000 --wait-ready");
  lbea::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::send(options); });
}
