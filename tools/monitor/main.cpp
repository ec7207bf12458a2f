// lbea-monitor: a web page that shows a running test or a recording.
#include "tools/monitor/feeds/live_feed.hpp"
#include "tools/monitor/feeds/recording_feed.hpp"
#include "tools/monitor/web/web_server.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/handshake.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <thread>

#include <sched.h>
#include <sys/resource.h>

namespace lbea::tool {
namespace {

struct Options {
  std::string recording_file, results_endpoint, preview_endpoint, http = "127.0.0.1:8080";
  std::vector<std::string> model_files;  // one per component
  WebConfig web;
};

constexpr auto description =
    "Serves one web page that shows a running test, or a recording with a timeline: the measured cloud and the matched "
    "mesh, the verdict,\n"
    "curves, and the health of the chain. The page is read-only. By default it can be reached from this machine only;\n"
    "any other address needs a token, which is part of the address that lbea-monitor prints.";

constexpr int low_priority = 10, lowest_priority = 19;

/// The measurement has priority on a shared machine: during a running test all threads of this program run only while
/// the processors are idle.
void lower_priority(bool is_live) {
  const sched_param none{};
  if (is_live && sched_setscheduler(0, SCHED_IDLE, &none) == 0)
    return log_info("priority: lowest (SCHED_IDLE), idle processor time only");
  setpriority(PRIO_PROCESS, 0, is_live ? lowest_priority : low_priority);
  log_info("priority: nice {}", getpriority(PRIO_PROCESS, 0));
}

void add_options(Tool& tool, Options& options) {
  auto* recording =
      tool.add_option("recording", options.recording_file, "recording (.mcap) to show instead of a running test")
          ->check(existing_file());
  auto* results =
      tool.add_option("--results", options.results_endpoint, "endpoint on which lbea-serve publishes results")
          ->excludes(recording);
  tool.add_option("--frames", options.preview_endpoint, "endpoint of lbea-serve --preview, for the measured clouds")
      ->needs(results);
  tool.add_option("--model", options.model_files,
                  "baked model (.lbea) that the frames are matched with, several for several components; default: the "
                  "files that lbea-serve or the recording names")
      ->check(existing_file());
  tool.add_option("--http", options.http, "address and port of the page");
  tool.add_option("--allow-host", options.web.allowed_names,
                  "further host name under which browsers may request the page");
  tool.add_option("--public-origin", options.web.public_origin,
                  "address of a TLS proxy in front of the page, such as https://rig.example");
  tool.add_option("--token", options.web.token, "token for addresses that other machines can reach; default: random");
  tool.add_option("--watchers", options.web.limits.watchers, "maximum number of browsers")->check(in_range(1u, 1024u));
  auto* viewers =
      tool.add_flag("--foxglove", options.web.has_viewers,
                    "also serve the Foxglove WebSocket protocol on the same port: /frames, /results and /state")
          ->needs(results);
  tool.add_option("--foxglove-origin", options.web.viewer_origins,
                  "site whose viewer may connect, such as https://viewer.example")
      ->needs(viewers);
  tool.add_option("--assets", options.web.assets_folder,
                  "folder to read the files of the page from, for its development")
      ->check(existing_folder());
}

/// Opens the model that a recording or a matcher names. Throws Error when the file is missing or is another model.
Model open_model(const std::string& file, std::uint64_t checksum) {
  if (file.empty())
    throw Error(Status::bad_config, "the model that the frames were matched with is not named; give it with --model");
  Model model = Model::open(file);
  if (model.checksum() != checksum)
    throw Error(Status::bad_config,
                file + ": is no longer the model that the frames were matched with; give that model with --model");
  return model;
}

std::vector<NamedModel> open_named(const std::vector<ComponentSettings>& components) {
  std::vector<NamedModel> models;
  for (const auto& [name, file, checksum] : components) models.push_back({name, file, open_model(file, checksum)});
  return models;
}

/// The models that lbea-serve names in its states, which come twice a second; none when this program is stopped.
std::vector<NamedModel> models_of_server(const std::string& results_endpoint) {
  wire::WireContext context;
  wire::ResultSource results(context, results_endpoint);
  log_info("waiting for lbea-serve on {} to name its model", results_endpoint);
  const auto state = wait_for_state(results, [] { return stop_requested != 0; });
  if (!state) return {};
  if (!state->components.empty()) return open_named(components_of(*state));
  return {{"", state->model.file, open_model(state->model.file, state->model.checksum)}};
}

std::vector<NamedModel> models_of_recording(const std::string& recording) {
  const RunSettings settings = RecordedRun(recording).settings();
  if (!settings.components.empty()) return open_named(settings.components);
  return {{"", settings.model_file, open_model(settings.model_file, settings.model_checksum)}};
}

/// Throws Error{bad_config} when a given model is that of no recorded component, which would look like one without
/// frames.
std::vector<NamedModel> models_for(const Options& options) {
  if (options.model_files.empty()) return models_of_recording(options.recording_file);
  std::vector<NamedModel> models = open_models(options.model_files);
  const std::vector<ComponentSettings> recorded = RecordedRun(options.recording_file).settings().components;
  if (recorded.empty()) return models;
  for (const NamedModel& named : models)
    static_cast<void>(component_with(recorded, named.model.checksum(), named.file, options.recording_file));
  return models;
}

void wait_for_stop() {
  while (stop_requested == 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

int watch_recording(const Options& options) {
  const auto models = models_for(options);
  const auto feed = make_recording_feed(options.recording_file, models);
  const WebServer server(options.web, *feed);
  log_info("ready: {} ({} frames)", server.url(), feed->frames());
  wait_for_stop();
  return exit_ok;
}

int watch_test(const Options& options) {
  const auto models =
      options.model_files.empty() ? models_of_server(options.results_endpoint) : open_models(options.model_files);
  if (models.empty()) return exit_ok;
  const auto feed = make_live_feed(options.results_endpoint, options.preview_endpoint, models);
  WebServer server(options.web, *feed);
  const auto relay = [&](ViewerChannel channel, std::int64_t time_ns, wire::Message message) {
    if (server.viewers() > 0)
      server.relay({channel, time_ns, {reinterpret_cast<const char*>(message.data()), message.size()}});
  };
  feed->start(
      {[&](Snapshot snapshot) { server.publish(std::move(snapshot)); }, [&] { return server.is_awaited(); }, relay});
  log_info("ready: {}", server.url());
  wait_for_stop();
  feed->stop();
  return exit_ok;
}

int watch(Options options) {
  const Log log("lbea-monitor");
  catch_stop_signals();
  if (options.recording_file.empty() == options.results_endpoint.empty())
    throw Error(Status::bad_config, "give --results for a running test, or the file of a recording");
  lower_priority(options.recording_file.empty());
  WebConfig& web = options.web;
  web.address = http::parse_address(options.http, "--http");
  if (web.token.empty() && (!web.address.is_loopback || !web.public_origin.empty())) web.token = random_token();
  web.limits.connections = web.limits.watchers * 2;
  return options.recording_file.empty() ? watch_test(options) : watch_recording(options);
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool(
      "lbea-monitor", lbea::tool::description,
      "lbea-monitor --results tcp://127.0.0.1:5556 --frames ipc:///tmp/preview.ipc --model rail.lbea");
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::watch(options); });
}
