// lbea-send: sends point clouds from files to a matcher, as a camera does.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/wire/sockets/endpoint.hpp"
#include "tools/send/player.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/tool.hpp"

namespace lbea::tool {
namespace {

constexpr auto description =
    "Sends point clouds from files (--list-formats) as frames. All clouds are read and encoded before the first one is "
    "sent.\n"
    "With --rate or --realtime a frame without room at the receiver is refused and counted, because a camera cannot\n"
    "wait; otherwise sending waits. With --results sending starts after the matcher has registered this session, and\n"
    "at the end the matcher reports what arrived. The exit code is 1 when a frame was refused, did not leave this\n"
    "program or, with --results, did not arrive or had no room in the matcher's queue.";

void add_options(Tool& tool, SendOptions& options) {
  const std::string example = wire::example_endpoint("frames", 5555);
  tool.add_option("paths", options.paths, "files, or folders of them, sent in the order of their names")->required();
  tool.add_option("--to", options.endpoint, "endpoint of the matcher's frames, e.g. " + example)->required();
  tool.add_option("--results", options.results_endpoint,
                  "endpoint of the matcher's results: register before the start and compare counts at the end");
  auto* rate = tool.add_option("--rate", options.rate_hz, "frames per second")->check(in_range(1e-3, 1e6));
  auto* realtime = tool.add_flag("--realtime", options.realtime, "pace by the clouds' stamps")->excludes(rate);
  tool.add_option(
          "--begin-ns", options.begin_ns,
          "with --realtime: begin at this time of the system's clock (ns since 1970), which is the first stamp: "
          "several lbea-send then play like rigs with one clock")
      ->needs(realtime);
  tool.add_option(
      "--stamps", options.stamps,
      "table of file,stamp_ns (or _us, _ms, _s) with capture times (default: stamps.csv beside the clouds)");
  add_columns_option(tool, options.columns);
  tool.add_option("--loop", options.rounds, "how often to send all of them; 0: until stopped")
      ->check(in_range(0, 1'000'000));
  tool.add_option("--frame-id", options.frame_id, "name of the points' coordinate system");
  tool.add_flag("--end-of-stream,!--open-end", options.ends_stream,
                "mark the end of the test after the last frame, and between rounds of stamped clouds");
  tool.add_flag("--wait-ready", options.wait_ready, "wait for the receiver without limit instead of 5 s");
  options.access.add_to(tool);
  tool.add_flag("--json", options.json, "print the closing tally as JSON");
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::SendOptions options;
  lbea::tool::Tool tool(
      "lbea-send", lbea::tool::description,
      "lbea-send frames/ --to " + lbea::wire::example_endpoint("frames", 5555) + " --rate 1000 --wait-ready");
  lbea::tool::add_options(tool, options);
  tool.list_formats_by(lbea::io::list_cloud_formats());
  return tool.run(argc, argv, [&] { return lbea::tool::send(options); });
}
