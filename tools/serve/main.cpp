// lbea-serve: receives frames, matches each one, publishes the results.
#include "adapters/http/metrics.hpp"
#include "tools/serve/command_line.hpp"
#include "tools/serve/pipeline/inference_publisher.hpp"
#include "tools/serve/reports.hpp"
#include "tools/serve/supervision.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/cli/outlet.hpp"
#include "tools/shared/cli/service_notify.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/intake/peer_log.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/matching/preview.hpp"
#include "tools/shared/matching/views.hpp"

#include <spdlog/spdlog.h>

#include <unistd.h>

namespace lbea::tool {
namespace {

constexpr auto description =
    "Matches frames as they arrive and publishes a result for each.\n"
    "A frame without a free slot in the queue is dropped, counted, and published as a result.\n"
    "The exit code is 1 when any frame was dropped or all were rejected, when ids are missing between those received,\n"
    "when senders alternate, when something could not be recorded, or when the tally does not add up.";

PipelineConfig pipeline_config(const ServeOptions& options, const Model& model) {
  PipelineConfig config = options.pipeline;
  config.limits.max_points = options.matcher.max_points;
  config.max_matches = options.matcher.max_matches;
  config.description.version = LBEA_VERSION_STRING;
  config.description.method = name_of(options.matcher.method);
  config.description.model = summarize(model, options.model_file);
  return config;
}

/// Stored in the recording, for its replay.
RunSettings run_settings(const ServeOptions& options, const Model& model) {
  RunSettings settings{"lbea-serve " LBEA_VERSION_STRING,
                       options.model_file,
                       model.checksum(),
                       name_of(options.matcher.method),
                       options.matcher,
                       options.sensor_json,
                       0};
  settings.start_ns = wire::wall_clock_ns();
  return settings;
}

void require_memory(const ServeOptions& options) {
  const auto pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
  const std::uint64_t installed = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
  const std::uint64_t needed = queue_bytes(options);
  if (needed > installed / 2)
    throw Error(Status::bad_config,
                fmt::format("--queue {} frames of --max-points {} need {} MB, more than half of this machine's {} MB; "
                            "lower one of them",
                            options.pipeline.queue_slots, options.matcher.max_points, needed >> 20, installed >> 20));
}

void report(const std::vector<Privilege>& privileges) {
  for (const Privilege& privilege : privileges)
    spdlog::log(privilege.granted ? spdlog::level::info : spdlog::level::warn, "--{}: {}", privilege.name,
                privilege.detail);
}

/// Runs until a stop signal; reports to systemd as long as all threads advance. False when the model was overwritten.
bool supervise(Pipeline& pipeline, std::vector<PeerLog> peer_logs, RecordingLog& recording, ModelWatch& model,
               const ServiceNotify& service) {
  Watchdog watchdog(pipeline);
  auto next_status = std::chrono::steady_clock::now();
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    recording.poll();
    pipeline.write_log();
    if (!model.poll()) return false;
    const auto now = std::chrono::steady_clock::now();
    if (watchdog.poll(now)) service.alive();
    for (PeerLog& peers : peer_logs) peers.poll(now);
    if (now < next_status) continue;
    service.status(tally_line(pipeline.counters()));
    next_status = now + std::chrono::seconds(1);
  }
  return true;
}

/// The observers that publish on sockets of their own.
struct Publishers {
  std::optional<Preview> preview;
  std::optional<InferencePublisher> inference;

  void start(wire::WireContext& context, const ServeOptions& options, const wire::ServerAccess& access,
             const wire::WireLimits& limits, const Model& model, RunObservers& observers) {
    if (!options.preview_endpoint.empty())
      observers.add(&preview.emplace(
          context, options.preview_endpoint,
          PreviewConfig{.limits = limits, .T_reference_sensor = options.matcher.T_reference_sensor, .access = access}));
    if (!options.inference_endpoint.empty())
      observers.add(
          &inference.emplace(context, options.inference_endpoint, access, model, field_to_infer(options, model)));
  }
};

std::vector<PeerLog> peer_logs(Pipeline& pipeline, Publishers& publishers) {
  std::vector<PeerLog> logs;
  logs.emplace_back(
      "frames", [&] { return pipeline.frame_visits(); }, [&] { return pipeline.frame_peers(); });
  logs.emplace_back(
      "results", [&] { return pipeline.result_visits(); }, [&] { return pipeline.result_peers(); });
  const auto add = [&](const char* endpoint, wire::ResultSink& sink) {
    logs.emplace_back(
        endpoint, [&sink] { return sink.visits(); }, [&sink] { return sink.peers(); });
  };
  if (publishers.preview) add("preview", publishers.preview->sink());
  if (publishers.inference) add("inference", publishers.inference->sink());
  return logs;
}

int serve_model(const ServeOptions& options, const Model& model, bool is_held) {
  const std::string length_unit(model.length_unit());  // a copy: the file may be overwritten during the test
  ModelEngine engine(model, options.matcher, views_for(options.matcher, model, options.sensor_json, options.pose_file));
  wire::WireContext context;
  const ServiceNotify service;
  PipelineConfig config = pipeline_config(options, model);
  config.on_matching_thread = [&] { report(request_for_thread(options.privileges)); };
  const wire::ServerAccess listeners = options.access.load_for_listeners();
  wire::FrameSource frames(context, options.frames_endpoint, config.limits, options.access.load());
  wire::ResultSink results(context, options.results_endpoint, wire::results_held, listeners);
  const std::string ready = fmt::format("ready: frames on {}, results on {}, {} samples of {} simulations",
                                        frames.endpoint(), results.endpoint(), model.samples(), model.simulations());
  const auto recorder = begin_recording(options.recording, run_settings(options, model));
  RecordingLog recording(recorder.get(), options.recording.file);
  RunObservers observers;
  observers.add(recorder.get());
  Publishers publishers;
  publishers.start(context, options, listeners, config.limits, model, observers);
  config.observer = &observers;
  Pipeline pipeline(config, engine, std::move(frames), std::move(results));
  std::optional<http::MetricsServer> metrics;
  if (!options.metrics_address.empty())
    metrics.emplace(options.metrics_address, [&] { return metrics_page(pipeline); });
  spdlog::info(ready);
  warn_of_unbounded_peers();
  if (metrics) spdlog::info("metrics on http://{}/metrics", metrics->address());
  service.ready(ready);
  ModelWatch model_watch(model, options.model_file, !is_held);
  const bool has_model = supervise(pipeline, peer_logs(pipeline, publishers), recording, model_watch, service);
  service.stopping();
  pipeline.stop();
  pipeline.write_log();
  warn_of_unfinished(pipeline.senders());
  const bool all_recorded = recording.finish();
  const wire::Counters counters = pipeline.counters();
  const std::string refusal = refusal_of_all(counters, length_unit);
  if (!refusal.empty()) spdlog::error(refusal);
  wait_for_log();
  print_last_line(options.json ? tally_json(counters) : tally_line(counters));
  return has_model && is_complete(counters) && all_recorded && refusal.empty() ? exit_ok : exit_failed;
}

int serve(ServeOptions options) {
  const Log log("lbea-serve");
  catch_stop_signals();
  catch_trigger_signal();
  raise_descriptor_limit();
  require_distinct_endpoints({{"--frames", options.frames_endpoint},
                              {"--results", options.results_endpoint},
                              {"--preview", options.preview_endpoint},
                              {"--inference", options.inference_endpoint}});
  if (options.check) return check(options);
  const Model model = Model::open(options.model_file);
  read_pose_file(options, model);
  choose_method(options, model);
  if (!options.method && options.matcher.method != Method::fit)
    spdlog::warn("method {}: the model has no depth images for this pose, so no verdict; see --method fit",
                 name_of(options.matcher.method));
  const bool is_held = model.hold(options.matcher.method);
  report(request_for_process(options.privileges, &model, options.matcher.method));
  require_memory(options);
  return serve_model(options, model, is_held);
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::ServeOptions options;
  lbea::tool::Tool tool(
      "lbea-serve", lbea::tool::description,
      "lbea-serve rail.lbea --frames ipc:///tmp/frames.ipc --results tcp://127.0.0.1:5556 --pose sensor.json");
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::serve(options); });
}
