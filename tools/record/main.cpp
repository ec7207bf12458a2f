// lbea-record: records frames without a matcher, or between a rig and its matcher.
#include "adapters/wire/sockets/endpoint.hpp"
#include "tools/record/frame_recorder.hpp"
#include "tools/shared/cli/tool.hpp"

namespace lbea::tool {
namespace {

constexpr auto description =
    "Records the frames of rigs. With --forward it also forwards everything to a matcher: the rigs then send to this\n"
    "program. Where lbea-serve runs, its own --record is simpler.\n"
    "Recording never waits for the matcher: a frame without room there is recorded and counted as refused.\n"
    "The exit code is 1 when a frame could not be recorded, had no room at the matcher, or did not arrive, and when a\n"
    "sender stopped without goodbye.";

void add_options(Tool& tool, RecordOptions& options) {
  tool.add_option("FILE", options.recording.file,
                  "the recording (MCAP), which must not exist yet; its name may contain the time of the start in "
                  "strftime's notation: %Y-%m-%d_%H-%M-%S.mcap")
      ->required()
      ->transform(recording_name());
  tool.add_option("--frames", options.rig_options.frames,
                  "endpoint to receive frames on, e.g. " + wire::example_endpoint("rig", 5554) +
                      "; from several rigs NAME=ENDPOINT, once for each")
      ->repeatable()
      ->required()
      ->check(not_empty());
  tool.add_option("--forward", options.forward,
                  "endpoint of a matcher's frames, to forward to; with several rigs NAME=ENDPOINT, once for each")
      ->repeatable()
      ->check(not_empty());
  tool.add_option("--results", options.results_endpoint, "endpoint of a matcher's results, to record as well")
      ->check(not_empty());
  tool.add_option("--pose", options.rig_options.poses,
                  "sensor.json, as given to the matcher, to record as well: a replay needs it; with several rigs "
                  "NAME=FILE, once for each")
      ->repeatable()
      ->check(not_empty());
  tool.add_option("--clock-offset-ns", options.rig_options.clock_offsets,
                  "several rigs: NAME=NS, as given to the matcher; may be repeated")
      ->repeatable();
  add_recording_options(tool, options.recording);
  const auto set_trigger = [&](std::int64_t stamp_ns) { options.recording.trigger_ns = stamp_ns; };
  tool.add_option_function(
      "--trigger-ns", set_trigger,
      "the sender's clock (with several rigs, their common one) at impact, as given to the matcher; "
      "a replay needs it");
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
    read_rigs(options);
    const bool has_matcher = !options.forward.empty() || !options.results_endpoint.empty();
    if (!options.matcher_access.server_key_file.empty() && !has_matcher)
      throw WrongUsage("--server-key: is for --forward and --results, and neither is given");
  });
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::RecordOptions options;
  lbea::tool::Tool tool("lbea-record", lbea::tool::description,
                        "lbea-record test.mcap --frames " + lbea::wire::example_endpoint("rig", 5554) + " --forward " +
                            lbea::wire::example_endpoint("frames", 5555));
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::record(options); });
}
