#include "tools/serve/command_line.hpp"

#include "adapters/wire/sockets/endpoint.hpp"
#include "tools/serve/system.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/views/views.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr const char* rigs_heading = "Several rigs";

void add_matching_options(Tool& tool, ServeOptions& options) {
  MatcherConfig& matcher = options.matcher;
  tool.add_choice("--method", options.method, method_names,
                  "default: fit when the model has depth images for the pose, else lbea. fit: compares depth images, "
                  "with a verdict, an estimate between the samples and the state of the "
                  "test; lbea: in the eigenbasis (eq. 3); vtp: by positions (eq. 1)");
  tool.add_option("--pose", options.rig_options.poses,
                  "sensor.json with T_reference_sensor; without it frames must be in reference coordinates. With fit, "
                  "the whole rig: when the model was not baked for this pose, its samples are rendered at the start. "
                  "With several rigs NAME=FILE, once for each")
      ->repeatable();
  tool.add_flag("--fixed-pose{false}", options.estimates_pose,
                "with fit: do not estimate the pose error of each test from its frames");
  tool.add_flag("--frames-alone", options.frames_alone,
                "with fit: match each frame without what the earlier ones of its test have shown (pose error, shapes, "
                "time of the impact)");
  tool.add_option("--matchers", options.pipeline.matchers,
                  "matching threads: frames are matched side by side, results are the same and in the same order; with "
                  "fit only if --frames-alone, otherwise one after the other")
      ->check(in_range(1u, 64u));
  const auto set_trigger = [&](std::int64_t stamp_ns) { options.recording.trigger_ns = matcher.trigger_ns = stamp_ns; };
  tool.add_option_function("--trigger-ns", set_trigger,
                           "the sender's clock (with several rigs, their common one) at impact; default: fit estimates "
                           "it, and for the reference mesh it is 0");
  tool.add_option("--max-points", matcher.max_points, "larger frames are rejected")
      ->check(in_range(1u, wire::WireLimits::most_points));
  tool.add_option("--matches", matcher.max_matches, "samples per result, best first")->check(in_range(1u, 1000u));
  tool.add_option("--trusted-distance", matcher.trusted_distance,
                  "a vertex counts as seen when a point is within this distance, in the model's length unit")
      ->check(positive_number())
      ->default_text("3 mm");
  tool.add_option("--min-coverage", matcher.min_coverage,
                  "minimum share of the surface seen; below it a match is not trusted")
      ->check(in_range(0.0f, 1.0f));
}

/// For several rigs.
void add_rig_options(Tool& tool, ServeOptions& options) {
  GroupingConfig& grouping = options.pipeline.grouping;
  tool.add_option("--clock-offset-ns", options.rig_options.clock_offsets,
                  "NAME=NS: what to add to the stamps of a rig, so that all rigs have one clock; may be repeated")
      ->repeatable()
      ->group(rigs_heading);
  const auto add = [&](const char* name, std::chrono::nanoseconds& value, const char* help) {
    const auto set = [&value](std::int64_t us) { value = std::chrono::microseconds(us); };
    tool.add_option_function(name, set, help)
        ->check(in_range(1, 1'000'000))
        ->default_text(std::to_string(value / std::chrono::microseconds(1)))
        ->group(rigs_heading);
  };
  add("--window-us", grouping.window, "frames captured within this time are fitted together, microseconds");
  add("--wait-us", grouping.wait, "the longest time that a frame waits for those of the other rigs, microseconds");
}

void require_joint_settings(const ServeOptions& options) {
  if (!options.has_several_rigs()) return;
  if (options.pipeline.grouping.window > options.pipeline.grouping.wait)
    throw WrongUsage("--window-us is longer than --wait-us: frames of a capture would not be waited for");
  if (options.method.value_or(Method::fit) != Method::fit || options.frames_alone || options.pipeline.matchers > 1)
    throw WrongUsage(
        "several rigs are matched by --method fit, with the history of the test and one thread per rig: "
        "omit --method, --frames-alone and --matchers, or give one --frames");
}

void require_settings_of_components(const ServeOptions& options) {
  if (!options.has_several_components()) return;
  static_cast<void>(component_names(options.model_files));
  if (options.has_several_rigs())
    throw WrongUsage(
        "several --frames takes one model: they do not work with several components yet; give one --frames, or one "
        "model");
  if (options.pipeline.matchers > 1)
    throw WrongUsage(
        "--matchers takes one model: each frame is matched with several models side by side, on a thread per "
        "component; omit it");
}

void add_operation_options(Tool& tool, ServeOptions& options) {
  tool.add_option("--metrics", options.metrics_address,
                  "address on this machine for Prometheus metrics, e.g. 127.0.0.1:9464");
  tool.add_option("--pin", options.privileges.pin,
                  "processor for the matching thread; with --matchers, for the first one, the others follow");
  tool.add_option("--realtime", options.privileges.realtime, system::realtime_text())->check(in_range(1, 99));
  tool.add_flag("--lock-memory", options.privileges.lock_memory, system::lock_text());
  tool.add_flag("--check", options.check,
                "test everything that can be tested without frames, print the findings, and exit");
  tool.add_flag("--json", options.json, "print the closing tally, or the findings of --check, as JSON");
}

void add_endpoints(Tool& tool, ServeOptions& options) {
  tool.add_option("model", options.model_files,
                  "baked model (.lbea); several: each frame is matched with each of these components, which are named "
                  "after their files")
      ->required();
  tool.add_option("--frames", options.rig_options.frames,
                  "endpoint to receive frames on, e.g. " + wire::example_endpoint("frames", 5555) +
                      "; from several rigs that see the component at the same time NAME=ENDPOINT, once for each")
      ->repeatable()
      ->required();
  tool.add_option("--results", options.results_endpoint, "endpoint to publish results on, e.g. tcp://127.0.0.1:5556")
      ->required();
  tool.add_option("--preview", options.preview_endpoint,
                  "endpoint to publish thinned clouds on, at most 30 a second, for lbea-monitor, e.g. " +
                      wire::example_endpoint("preview", 5557));
  auto* inferred = tool.add_option(
      "--infer", options.inferred_field,
      "with fit: field to infer on the whole component, including hidden parts, for every frame, e.g. plastic_strain");
  tool.add_option("--inference", options.inference_endpoint,
                  "endpoint to publish the inferred field on, with its spread over the plausible samples")
      ->needs(inferred);
  inferred->needs("--inference");
}

}  // namespace

void add_options(Tool& tool, ServeOptions& options) {
  add_endpoints(tool, options);
  add_matching_options(tool, options);
  add_rig_options(tool, options);
  tool.add_usage_check([&options] {
    options.rigs = read_rigs(options.rig_options);
    require_joint_settings(options);
    require_settings_of_components(options);
  });
  tool.add_option("--queue", options.pipeline.queue_slots, "frames of each rig that may wait for the matcher")
      ->check(in_range(1u, 4096u));
  tool.add_flag("--one-sender", options.pipeline.one_sender,
                "drop the frames of a second sender until the first one says goodbye or is silent for 3 s");
  auto* record =
      tool.add_option("--record", options.recording.file,
                      "record all frames and results to this file (MCAP), which must not exist yet; its name may "
                      "contain the time of the start in strftime's notation: %Y-%m-%d_%H-%M-%S.mcap")
          ->transform(recording_name());
  add_recording_options(tool, options.recording);
  tool.get_option("--record-window")->needs(record);
  options.access.add_to(tool);
  options.access.add_listeners_to(tool);
  add_operation_options(tool, options);
}

void read_poses(ServeOptions& options, const Model& model) {
  read_poses(options.rigs, model.length_unit());
  options.matcher.T_reference_sensor = options.rigs.front().T_reference_sensor;
}

void choose_method(ServeOptions& options, const std::vector<NamedModel>& models) {
  const bool has_images = options.has_several_rigs() || std::ranges::all_of(models, [&](const NamedModel& served) {
                            return has_images_for(options.matcher.T_reference_sensor, served.model);
                          });
  options.matcher.method = options.method.value_or(has_images ? Method::fit : Method::lbea);
}

std::vector<Finding> check_options(const ServeOptions& options, const Model& model) {
  std::vector<Finding> findings;
  if (!options.method && options.matcher.method != Method::fit)
    findings.push_back({"method", Finding::Level::warning,
                        std::string(name_of(options.matcher.method)) +
                            ", because the model has no depth images for this pose: no verdict; see --method fit"});
  if (options.pipeline.matchers > 1 && options.matcher.method == Method::fit && !options.frames_alone)
    findings.push_back({"matchers", Finding::Level::warning,
                        "fit matches the frames of a test one after the other, with what the earlier ones have shown; "
                        "side by side with --frames-alone"});
  if (model.reference_mode() == ReferenceMode::over_time && !options.recording.trigger_ns)
    findings.push_back({"trigger-ns", Finding::Level::warning,
                        "missing: the model was baked over time, so its reference mesh depends on the time since the "
                        "impact; without it, frames are matched with the last one"});
  return findings;
}

std::vector<InferredField> fields_to_infer(const ServeOptions& options, const std::vector<NamedModel>& models) {
  if (options.matcher.method != Method::fit)
    throw Error(Status::bad_config, "--infer needs the estimate of --method fit; choose that method, or omit --infer");
  std::vector<InferredField> fields;
  for (const NamedModel& named : models) {
    const bool is_one = models.size() == 1;
    try {
      fields.push_back({is_one ? "" : named.name, named.model, find_field(named.model, options.inferred_field)});
    } catch (const Error& error) {
      if (is_one) throw;
      throw Error(error.status, named.file + ": " + error.what());
    }
  }
  return fields;
}

std::uint64_t queue_bytes(const ServeOptions& options) {
  PipelineConfig pipeline = options.pipeline;
  if (options.has_several_rigs()) pipeline.rigs.resize(options.rigs.size());
  const std::uint64_t slots = pipeline.queue_capacity();
  return slots * options.matcher.max_points * sizeof(Point);
}

}  // namespace lbea::tool
