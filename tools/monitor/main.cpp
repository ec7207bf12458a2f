// lbea-monitor: a web page that shows a running test.
#include "tools/common/tool.hpp"
#include "tools/monitor/live_feed.hpp"
#include "tools/monitor/web_server.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <sys/resource.h>

namespace lbea {

namespace {

struct Options {
  std::string results_endpoint, preview_endpoint, model_file, http = "127.0.0.1:8080", assets_folder, token;
  std::vector<std::string> allowed_names;
  WebLimits limits;
};

constexpr auto description =
    "Serves one web page that shows a running test: the measured cloud and the mesh it was matched with, the verdict,\n"
    "curves, and the health of the chain. Nothing can be changed from the page. By default only this machine reaches it;\n"
    "on any other address a token is needed, which is part of the address that is printed.";

constexpr int politeness = 10;  // the measurement comes first where both run on one machine

void add_options(Tool& tool, Options& options) {
  tool.add_option("--results", options.results_endpoint, "endpoint on which lbea-serve publishes results")->required();
  tool.add_option("--frames", options.preview_endpoint, "endpoint of lbea-serve --preview, for the measured clouds");
  tool.add_option("--model", options.model_file, "the baked model (.lbea) that lbea-serve uses")->required()->check(CLI::ExistingFile);
  tool.add_option("--http", options.http, "address and port to serve the page on");
  tool.add_option("--allow-host", options.allowed_names, "name under which browsers ask for the page, beside its address");
  tool.add_option("--token", options.token, "for addresses that other machines reach; drawn at random when not given");
  tool.add_option("--watchers", options.limits.watchers, "browsers at a time")->check(CLI::Range(1u, 1024u));
  tool.add_option("--assets", options.assets_folder, "serve the page's files from this folder, while working on them")->check(CLI::ExistingDirectory);
}

int watch(Options options) {
  catch_stop_signals();
  setpriority(PRIO_PROCESS, 0, politeness);
  const HttpAddress address = parse_http_address(options.http);
  if (options.token.empty() && !address.is_loopback) options.token = random_token();
  options.limits.connections = options.limits.watchers * 2;
  LiveFeed feed({options.results_endpoint, options.preview_endpoint}, Model::open(options.model_file));
  WebServer server({address, options.allowed_names, options.token, options.limits}, Assets(options.assets_folder), feed);
  feed.start({[&](Snapshot snapshot) { server.publish(std::move(snapshot)); }, [&] { return server.watchers() > 0; }});
  spdlog::info("ready: {}", server.url());
  while (stop_requested == 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  feed.stop();
  return exit_ok;
}

}  // namespace

}  // namespace lbea

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lbea-monitor"));
  lbea::Options options;
  lbea::Tool tool("lbea-monitor", lbea::description,
                  "lbea-monitor --results tcp://127.0.0.1:5556 --frames ipc:///tmp/preview.ipc --model rail.lbea");
  lbea::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::watch(options); });
}
