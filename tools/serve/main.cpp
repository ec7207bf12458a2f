// lbea-serve: receives frames, matches each one, publishes the results.
#include "adapters/http/metrics.hpp"
#include "adapters/wire/sockets/endpoint.hpp"
#include "runtime/src/depth/test_clock.hpp"
#include "runtime/src/model/mapped_file.hpp"
#include "tools/serve/command_line.hpp"
#include "tools/serve/reports.hpp"
#include "tools/serve/system.hpp"
#include "tools/serve/watches.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/matching/preview.hpp"
#include "tools/shared/system/service_notify.hpp"
#include "tools/shared/system/trigger_signal.hpp"
#include "tools/shared/text/last_line.hpp"
#include "tools/shared/views/views.hpp"

namespace lbea::tool {
namespace {

constexpr auto description =
    "Matches frames as they arrive and publishes a result for each.\n"
    "A frame without a free slot in the queue is dropped, counted, and published as a result.\n"
    "The exit code is 1 when any frame was dropped or all were rejected, when ids are missing between those received,\n"
    "when senders alternate, when something could not be recorded, or when the tally does not add up.";

PipelineConfig pipeline_config(const ServeOptions& options, const std::vector<NamedModel>& models) {
  const Model& model = models.front().model;
  PipelineConfig config = options.pipeline;
  config.limits.max_points = options.matcher.max_points;
  config.max_matches = options.matcher.max_matches;
  if (const auto& trigger_ns = options.recording.trigger_ns)
    config.impact = ExpectedImpact{*trigger_ns, EnsembleTimes::of(model.view()).duration_s};
  config.description.version = LBEA_VERSION_STRING;
  config.description.method = name_of(options.matcher.method);
  config.description.model = summarize(model, models.front().file);
  for (const NamedModel& served : models) {
    if (models.size() == 1) break;
    config.components.push_back({served.name, served.model.checksum()});
    config.description.components.push_back({served.name, summarize(served.model, served.file)});
  }
  for (const NamedRig& rig : options.rigs)
    if (options.has_several_rigs()) config.rigs.push_back({rig.name, rig.clock_offset_ns});
  return config;
}

/// Stored in the recording, for its replay.
RunSettings run_settings(const ServeOptions& options, const std::vector<NamedModel>& models) {
  const Model& model = models.front().model;
  RunSettings settings;
  for (const NamedModel& served : models)
    if (models.size() > 1) settings.components.push_back({served.name, served.file, served.model.checksum()});
  settings.program = "lbea-serve " LBEA_VERSION_STRING;
  settings.model_file = options.model_files.front();
  settings.model_checksum = model.checksum();
  settings.method = name_of(options.matcher.method);
  settings.matcher = options.matcher;
  settings.estimates_pose = options.estimates_pose ? 1 : 0;
  settings.knows_impact = options.recording.trigger_ns ? 1 : 0;
  settings.frames_alone = options.frames_alone ? 1 : 0;
  settings.sensor_json = options.rigs.front().sensor_json;
  if (options.has_several_rigs()) settings.rigs.assign(options.rigs.begin(), options.rigs.end());
  settings.start_ns = wire::wall_clock_ns();
  return settings;
}

void require_memory(const ServeOptions& options) {
  const std::uint64_t installed = memory_of_machine(), needed = queue_bytes(options);
  if (needed > installed / 2)
    throw Error(Status::bad_config,
                fmt::format("--queue {} frames of --max-points {} need {} MB, more than half of this machine's {} MB; "
                            "lower one of them",
                            options.pipeline.queue_slots, options.matcher.max_points, needed >> 20, installed >> 20));
}

void report(const std::vector<Finding>& findings) {
  for (const auto& [name, level, text] : findings)
    if (level == Finding::Level::ok)
      log_info("--{}: {}", name, text);
    else
      log_warning("--{}: {}", name, text);
}

/// Runs until a stop signal; reports to systemd as long as all threads advance. False when a model was overwritten.
bool supervise(Pipeline& pipeline, std::vector<PeerLog> peer_logs, RecordingLog& recording,
               std::vector<ModelWatch> models, const ServiceNotify& service) {
  Watchdog watchdog(pipeline);
  auto next_status = std::chrono::steady_clock::now();
  while (stop_requested == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    recording.poll();
    pipeline.write_log();
    for (ModelWatch& model : models)
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

std::vector<RigidTransform> poses_of(const std::vector<NamedRig>& rigs) {
  std::vector<RigidTransform> poses;
  for (const NamedRig& rig : rigs) poses.push_back(rig.T_reference_sensor);
  return poses;
}

/// The observers that publish on sockets of their own.
struct Publishers {
  std::optional<Preview> preview;
  std::optional<InferencePublisher> inference;

  void start(wire::WireContext& context, const ServeOptions& options, const wire::ServerAccess& access,
             const wire::WireLimits& limits, const std::vector<NamedModel>& models, RunObservers& observers) {
    if (!options.preview_endpoint.empty())
      observers.add(&preview.emplace(
          context, options.preview_endpoint,
          PreviewConfig{.limits = limits, .T_reference_sensor = poses_of(options.rigs), .access = access}));
    if (!options.inference_endpoint.empty())
      observers.add(&inference.emplace(context, options.inference_endpoint, access, fields_to_infer(options, models)));
  }
};

/// Prints the last line of the program. Returns its exit code.
int conclude(const Pipeline& pipeline, const std::string& length_unit, bool as_json, bool is_whole) {
  const wire::Counters counters = pipeline.counters();
  const std::string refusal = refusal_of_all(counters, length_unit);
  if (!refusal.empty()) log_error("{}", refusal);
  wait_for_log();
  print_last_line(as_json ? tally_json(counters, pipeline.rigs()) : tally_line(counters, pipeline.rigs()));
  return is_whole && is_complete(counters) && refusal.empty() ? exit_ok : exit_failed;
}

std::vector<PeerLog> peer_logs(Pipeline& pipeline, Publishers& publishers) {
  std::vector<PeerLog> peers = pipeline.peer_logs();
  if (publishers.preview) peers.emplace_back("preview", publishers.preview->sink());
  if (publishers.inference) peers.emplace_back("inference", publishers.inference->sink());
  return peers;
}

std::vector<wire::FrameSource> bind_frames(wire::WireContext& context, const ServeOptions& options,
                                           PipelineConfig& config) {
  std::vector<wire::FrameSource> sources;
  for (const NamedRig& rig : options.rigs) {
    sources.emplace_back(context, rig.endpoint, config.limits, options.access.load());
    if (options.has_several_rigs())
      config.description.rigs.push_back({rig.name, sources.back().endpoint(), rig.clock_offset_ns, {}});
  }
  return sources;
}

/// The matcher of one rig, of several, or of several components.
struct Engines {
  std::optional<ModelEngine> of_one;
  std::optional<ModelRigEngine> of_several;
  std::optional<ModelComponents> of_components;

  Engines(const ServeOptions& options, const std::vector<NamedModel>& models) {
    const Model& model = models.front().model;
    const HistorySettings settings{!options.frames_alone, options.estimates_pose,
                                   options.recording.trigger_ns.has_value()};
    if (models.size() > 1)
      start_components(matched_components(models, options.rigs.front(), options.matcher), options, settings);
    else if (options.has_several_rigs())
      of_several.emplace(model, options.matcher, matched_rigs(options.rigs, options.matcher, model), settings);
    else
      of_one.emplace(model, options.matcher, views_for(options.rigs.front(), options.matcher, model), settings,
                     options.pipeline.matchers);
  }
  [[nodiscard]] std::unique_ptr<Pipeline> start(PipelineConfig config, std::vector<wire::FrameSource> frames,
                                                wire::ResultSink results) {
    if (of_several)
      return std::make_unique<Pipeline>(std::move(config), *of_several, std::move(frames), std::move(results));
    if (of_components)
      return std::make_unique<Pipeline>(std::move(config), *of_components, std::move(frames.front()),
                                        std::move(results));
    return std::make_unique<Pipeline>(std::move(config), *of_one, std::move(frames.front()), std::move(results));
  }

 private:
  void start_components(const std::vector<ComponentModel>& components, const ServeOptions& options,
                        const HistorySettings& settings) {
    of_components.emplace(components, options.matcher, settings);
    if (options.matcher.method == Method::fit) log_info("tracked: {}", coupling_text(components));
  }
};

std::string samples_of(const std::vector<NamedModel>& models) {
  std::string text;
  for (const NamedModel& served : models)
    text +=
        fmt::format("{}{}{} samples of {} simulations", text.empty() ? "" : ", ",
                    models.size() > 1 ? served.name + ": " : "", served.model.samples(), served.model.simulations());
  return text;
}

std::string ready_line(const std::vector<wire::FrameSource>& frames, const ServeOptions& options,
                       const wire::ResultSink& results, const std::vector<NamedModel>& models) {
  std::string endpoints;
  for (std::size_t rig = 0; rig < frames.size(); ++rig) {
    const std::string of = options.has_several_rigs() ? " of " + options.rigs[rig].name : "";
    endpoints += fmt::format("frames{} on {}, ", of, frames[rig].endpoint());
  }
  return fmt::format("ready: {}results on {}, {}", endpoints, results.endpoint(), samples_of(models));
}

std::vector<ModelWatch> hold(const std::vector<NamedModel>& models, Method method) {
  std::vector<ModelWatch> watches;
  for (const NamedModel& served : models) watches.emplace_back(served.model, served.file, !served.model.hold(method));
  return watches;
}

int serve_models(const ServeOptions& options, const std::vector<NamedModel>& models) {
  const Model& model = models.front().model;
  std::vector<ModelWatch> model_watches = hold(models, options.matcher.method);
  for (const NamedModel& served : models)
    report(request_for_process(options.privileges, &served.model, options.matcher.method));
  require_memory(options);
  const std::string length_unit(model.length_unit());  // a copy: the file may be overwritten during the test
  Engines engines(options, models);
  wire::WireContext context;
  const ServiceNotify service;
  PipelineConfig config = pipeline_config(options, models);
  config.on_matching_thread = [&](std::uint32_t matcher) { report(request_for_thread(options.privileges, matcher)); };
  const wire::ServerAccess listeners = options.access.load_for_listeners();
  std::vector<wire::FrameSource> frames = bind_frames(context, options, config);
  wire::ResultSink results(context, options.results_endpoint, wire::results_held, listeners);
  const std::string ready = ready_line(frames, options, results, models);
  const auto recorder = begin_recording(options.recording, run_settings(options, models));
  RecordingLog recording(recorder.get(), options.recording.file);
  RunObservers observers;
  observers.add(recorder.get());
  Publishers publishers;
  publishers.start(context, options, listeners, config.limits, models, observers);
  config.observer = &observers;
  const std::unique_ptr<Pipeline> pipeline = engines.start(config, std::move(frames), std::move(results));
  std::optional<http::MetricsServer> metrics;
  if (!options.metrics_address.empty())
    metrics.emplace(options.metrics_address, [&] { return metrics_page(*pipeline); });
  log_info("{}", ready);
  warn_of_unbounded_peers();
  if (metrics) log_info("metrics on http://{}/metrics", metrics->address());
  service.ready(ready);
  const bool has_model =
      supervise(*pipeline, peer_logs(*pipeline, publishers), recording, std::move(model_watches), service);
  service.stopping();
  pipeline->stop();
  pipeline->write_log();
  warn_of_unfinished(pipeline->senders());
  const bool all_recorded = recording.finish();
  return conclude(*pipeline, length_unit, options.json, has_model && all_recorded);
}

std::vector<std::pair<std::string, std::string>> endpoints_of(const ServeOptions& options) {
  std::vector<std::pair<std::string, std::string>> endpoints = frames_endpoints(options.rigs);
  endpoints.emplace_back("--results", options.results_endpoint);
  endpoints.emplace_back("--preview", options.preview_endpoint);
  endpoints.emplace_back("--inference", options.inference_endpoint);
  return endpoints;
}

int serve(ServeOptions options) {
  const Log log("lbea-serve");
  catch_stop_signals();
  catch_trigger_signal();
  system::raise_descriptor_limit();
  require_distinct_endpoints(endpoints_of(options));
  if (options.check) return check(options);
  const std::vector<NamedModel> models = open_models(options.model_files);
  read_poses(options, models.front().model);
  choose_method(options, models);
  report(check_options(options, models.front().model));
  return serve_models(options, models);
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::ServeOptions options;
  lbea::tool::Tool tool("lbea-serve", lbea::tool::description,
                        "lbea-serve rail.lbea --frames " + lbea::wire::example_endpoint("frames", 5555) +
                            " --results tcp://127.0.0.1:5556 --pose sensor.json");
  lbea::tool::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::serve(options); });
}
