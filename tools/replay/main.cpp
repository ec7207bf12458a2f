// lbea-replay: plays a recording to a matcher's socket, or straight into a model.
#include "tools/replay/replay_settings.hpp"
#include "tools/replay/socket_replay.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/recording/rig_settings.hpp"

#include <utility>

namespace lbea::tool {
namespace {

struct Options {
  std::string file, range;
  std::vector<std::string> poses;
  bool json = false;
  SocketReplayOptions socket;
  ModelReplayOptions model;
};

constexpr auto description =
    "Replays a recording. With --to, its frames are sent to a matcher like those of a camera, at the recorded pace.\n"
    "With --model, they are matched with this model and the recorded settings, as fast as possible. The same "
    "recording\n"
    "and model give the same results to the last bit on any number of threads.\n"
    "With --results the matcher reports at the end what it has received and what its queue had no room for. Without "
    "it,\n"
    "the fate of a sent frame is unknown. The exit code is 1 when a frame was refused or not delivered, with "
    "--results\n"
    "when one did not arrive or was dropped, and with --against when results differ or there are none to compare.";

void add_sending_options(Tool& tool, Options& options, Option* to, Option* model) {
  tool.add_option("--results", options.socket.results_endpoint,
                  "with --to: endpoint of the matcher's results, to compare counts at the end")
      ->needs(to);
  auto* speed = tool.add_option("--speed", options.socket.pace.speed, "relative to the recorded pace")
                    ->check(in_range(1e-3, 1e6))
                    ->excludes(model);
  auto* fast =
      tool.add_flag("--fast", options.socket.pace.fast, "with --to: as fast as possible; sending waits for room")
          ->excludes(speed);
  tool.add_flag("--step", options.socket.pace.steps, "one frame per line on standard input (Enter)")
      ->excludes(speed)
      ->excludes(fast)
      ->excludes(model);
  tool.add_option("--loop", options.socket.rounds, "with --to: how often to replay it; 0: until stopped")
      ->check(in_range(0, 1'000'000))
      ->excludes(model);
  tool.add_flag("--end-of-stream,!--open-end", options.socket.ends_stream,
                "with --to: announce the end of the test after the last frame");
  options.socket.access.add_to(tool);
}

void add_matching_options(Tool& tool, Options& options, Option* model) {
  SettingsOptions& settings = options.model.settings;
  tool.add_option("--threads", options.model.threads, "with --model")->check(in_range(1u, 256u));
  tool.add_choice("--method", settings.method, method_names, "with --model: instead of the recorded method")
      ->needs(model);
  auto* pose = tool.add_option("--pose", options.poses,
                               "with --model: sensor.json instead of the recorded one; of a recording of several rigs "
                               "NAME=FILE, for each that gets another one")
                   ->repeatable()
                   ->needs(model);
  tool.add_flag("--no-pose", settings.without_pose,
                "with --model: frames are in the reference's coordinates, as for lbea-serve without --pose")
      ->excludes(pose)
      ->needs(model);
  tool.add_flag("--frames-alone", settings.frames_alone,
                "with --model: match by fit as lbea-serve --frames-alone did, which lbea-record does not know")
      ->needs(model);
  tool.add_option("-o,--output", options.model.output, "with --model: write the results to this file (MCAP)")
      ->needs(model);
  auto* against =
      tool.add_flag("--against", options.model.compares, "with --model: compare the results with those recorded")
          ->needs(model);
  tool.add_option("--tolerance", options.model.tolerance,
                  "with --against: relative difference that best distance, coverage and quantities of interest (of "
                  "their peak) may have; 0: equal in every bit")
      ->check(in_range(0.0, 1.0))
      ->needs(against);
}

void add_options(Tool& tool, Options& options) {
  tool.add_option("FILE", options.file, "the recording")->required();
  auto* to = tool.add_option("--to", options.socket.to,
                             "endpoint of a matcher's frames, e.g. ipc:///tmp/frames.ipc; of a recording of several "
                             "rigs NAME=ENDPOINT, once for each")
                 ->check(not_empty())
                 ->repeatable();
  auto* model = tool.add_option("--model", options.model.model_files,
                                "baked model (.lbea) to match with; once for each component of the recording")
                    ->repeatable()
                    ->excludes(to);
  tool.add_option("--range", options.range, "FROM:TO in seconds after the first frame; either may be omitted");
  add_sending_options(tool, options, to, model);
  add_matching_options(tool, options, model);
  tool.add_flag("--json", options.json, "print as JSON");
}

/// To the rigs of the recording.
void assign_poses(const std::vector<RigSettings>& rigs, const std::vector<std::string>& poses,
                  SettingsOptions& settings) {
  settings.rig_pose_files = pose_files(values_per_recorded_rig(rigs, "--pose", "FILE", poses));
  if (rigs.empty()) settings.pose_file = std::exchange(settings.rig_pose_files, {}).front();
}

void require_destination(const Options& options) {
  if (options.socket.to.empty() && options.model.model_files.empty())
    throw WrongUsage("no destination. Give --to ENDPOINT or --model MODEL");
}

int replay(Options options) {
  const Log log("lbea-replay");
  catch_stop_signals();
  ModelReplayOptions& model = options.model;
  require_destination(options);
  const Range range(options.range);
  RecordedRun run(options.file);
  const Part part = part_of(run, range, options.file);
  if (!options.socket.to.empty()) {
    run.limit(part.from_ns, part.to_ns);
    run.rewind();
    options.socket.json = options.json;
    return replay_to_socket(run, options.socket) ? exit_ok : exit_failed;
  }
  model.json = options.json;
  model.settings.model_file = model.model_files.front();
  model.settings.recording = options.file;
  model.settings.needs_all = model.compares;
  assign_poses(run.settings().rigs, options.poses, model.settings);
  return replay_into_model(run, part, model) ? exit_ok : exit_failed;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool(
      "lbea-replay", lbea::tool::description,
      "lbea-replay test.mcap --to ipc:///tmp/frames.ipc\n  lbea-replay test.mcap --model rail.lbea --against");
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::replay(options); });
}
