#include "tools/serve/check.hpp"

#include "adapters/http/metrics.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/serve/inference_publisher.hpp"
#include "tools/serve/preflight.hpp"
#include "tools/shared/matching/views.hpp"

#include <cstdio>
#include <filesystem>
#include <optional>

#include <sys/resource.h>

namespace lbea::tool {
namespace {

constexpr std::uint64_t probe_bytes = std::uint64_t{256} << 20;
constexpr rlim_t enough_descriptors = 4096;

std::string describe(const Model& model, const std::string& file) {
  return file + ": " + std::to_string(model.samples()) + " samples of " + std::to_string(model.simulations()) +
         " simulations, " + std::to_string(model.vertices()) + " vertices";
}

std::string describe(const wire::ServerAccess& access) {
  if (!access.keys) return "no keys: this machine alone may connect";
  return std::to_string(access.allowed.size()) + " keys may connect";
}

std::string describe_fit(ServeOptions options, const Model& model) {
  read_pose_file(options);
  const MatcherConfig& config = options.matcher;
  const Matcher matcher(model, config, views_for(config, model, options.sensor_json, options.pose_file));
  return "a matcher is ready, with depth images for this pose";
}

void check_endpoints(Preflight& preflight, const ServeOptions& options) {
  wire::ServerAccess access;
  preflight.ask("keys", [&] {
    access = options.access.load();
    return describe(access);
  });
  wire::WireContext context;
  std::optional<wire::FrameSource> frames;
  std::optional<wire::ResultSink> results, preview, inference;
  preflight.ask("frames", [&] {
    return frames.emplace(context, options.frames_endpoint, wire::WireLimits{}, access).endpoint();
  });
  preflight.ask("results", [&] {
    return results.emplace(context, options.results_endpoint, wire::results_held, access).endpoint();
  });
  if (!options.preview_endpoint.empty())
    preflight.ask("preview", [&] {
      return preview.emplace(context, options.preview_endpoint, wire::results_held, access).endpoint();
    });
  if (!options.inference_endpoint.empty())
    preflight.ask("inference", [&] {
      return inference.emplace(context, options.inference_endpoint, wire::results_held, access).endpoint();
    });
  if (!options.metrics_address.empty())
    preflight.ask("metrics",
                  [&] { return http::MetricsServer(options.metrics_address, [] { return std::string(); }).address(); });
}

Finding check_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  const std::string text = std::to_string(limit.rlim_cur) + " may be open";
  if (limit.rlim_cur >= enough_descriptors) return {"descriptors", Finding::Level::ok, text};
  return {"descriptors", Finding::Level::warning,
          text + "; strangers who knock could use them up, raise LimitNOFILE= or ulimit -n"};
}

}  // namespace

int check(const ServeOptions& options) {
  Preflight preflight;
  std::optional<Model> model;
  preflight.ask("model", [&] { return describe(model.emplace(Model::open(options.model_file)), options.model_file); });
  if (!options.pose_file.empty())
    preflight.ask("pose", [&] { return static_cast<void>(io::read_pose(options.pose_file)), options.pose_file; });
  if (model && options.matcher.method == Method::fit)
    preflight.ask("fit", [&] { return describe_fit(options, *model); });
  if (model && !options.inferred_field.empty())
    preflight.ask("infer", [&] {
      return "field " + std::to_string(field_to_infer(options, *model)) + ", " + options.inferred_field;
    });
  check_endpoints(preflight, options);
  const bool records = !options.recording.file.empty();
  const std::uint64_t ring_bytes = records ? std::uint64_t{options.recording.memory_mb} << 20 : 0;
  const std::uint64_t model_bytes = model ? model->hot_bytes(options.matcher.method) : 0;
  preflight.note(check_memory(queue_bytes(options) + model_bytes + ring_bytes));
  for (Finding& finding : check_privileges(options.privileges, model ? &*model : nullptr, options.matcher.method))
    preflight.note(std::move(finding));
  for (Finding& finding : check_clock()) preflight.note(std::move(finding));
  preflight.note(check_descriptors());
  if (records) {
    preflight.ask("record", [&] { return check_recording(options.recording), options.recording.file; });
    const auto folder = std::filesystem::absolute(options.recording.file).parent_path();
    preflight.note(check_disk(folder, probe_bytes));
  }
  std::printf("%s\n", (options.json ? preflight.to_json() : preflight.to_text()).c_str());
  return preflight.passed() ? exit_ok : exit_failed;
}

}  // namespace lbea::tool
