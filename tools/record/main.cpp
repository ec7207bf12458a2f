// lbea-record: records frames without a matcher, or between a rig and its matcher.
#include "adapters/wire/sockets/endpoint.hpp"
#include "tools/record/frame_recorder.hpp"
#include "tools/shared/cli/tool.hpp"

namespace lbea::tool {
namespace {

constexpr auto description =
    "Records the frames of a rig. With --forward it also forwards everything to a matcher: the rig then sends to this\n"
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
  tool.add_option("--frames", options.frames_endpoint,
                  "endpoint to receive frames on, e.g. " + wire::example_endpoint("rig", 5554))
      ->required()
      ->check(not_empty());
  tool.add_option("--forward", options.forward_endpoint, "endpoint of a matcher's frames, to forward to")
      ->check(not_empty());
  tool.add_option("--results", options.results_endpoint, "endpoint of a matcher's results, to record as well")
      ->check(not_empty());
  add_recording_options(tool, options.recording);
  const auto set_trigger = [&](std::int64_t stamp_ns) { options.recording.trigger_ns = stamp_ns; };
  tool.add_option_function("--trigger-ns", set_trigger,
                           "the sender's clock at impact, as given to the matcher; a replay needs it");
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
