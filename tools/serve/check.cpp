#include "tools/serve/command_line.hpp"

#include "adapters/files/file_names.hpp"
#include "adapters/http/metrics.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tools/serve/machine.hpp"
#include "tools/serve/system.hpp"
#include "tools/shared/cli/method_names.hpp"
#include "tools/shared/views/views.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <optional>

namespace lbea::tool {
namespace {

std::string name_of(Finding::Level level) {
  constexpr std::array<const char*, 3> names{"ok", "warning", "failed"};
  return names[static_cast<std::size_t>(level)];
}

/// The findings of all checks.
class Preflight {
 public:
  /// Runs `question`; its return value is the finding's text, an exception makes it failed.
  void check(const std::string& name, const std::function<std::string()>& question) {
    try {
      add({name, Finding::Level::ok, question()});
    } catch (const std::exception& error) { add({name, Finding::Level::failed, error.what()}); }
  }
  void add(Finding finding) { findings_.push_back(std::move(finding)); }
  /// Nothing failed; warnings do not count.
  [[nodiscard]] bool passed() const noexcept {
    return std::ranges::find(findings_, Finding::Level::failed, &Finding::level) == findings_.end();
  }
  [[nodiscard]] std::string to_text() const {
    std::string text;
    for (const Finding& finding : findings_) {
      std::string level = name_of(finding.level), name = finding.name;
      level.resize(8, ' ');
      name.resize(std::max<std::size_t>(name.size(), 12), ' ');
      text += level + name + " " + finding.text + "\n";
    }
    return text + (passed() ? "ready for the test" : "not ready: see the failed checks");
  }
  [[nodiscard]] std::string to_json() const {
    nlohmann::ordered_json json{{"passed", passed()}, {"findings", nlohmann::ordered_json::array()}};
    for (const Finding& finding : findings_)
      json["findings"].push_back({{"name", finding.name}, {"level", name_of(finding.level)}, {"text", finding.text}});
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  }

 private:
  std::vector<Finding> findings_;
};

constexpr std::uint64_t probe_bytes = std::uint64_t{256} << 20;

std::string describe(const Model& model, const std::string& file) {
  return file + ": " + std::to_string(model.samples()) + " samples of " + std::to_string(model.simulations()) +
         " simulations, " + std::to_string(model.vertices()) + " vertices";
}

std::string describe(const wire::ServerAccess& senders, const wire::ServerAccess& listeners) {
  if (!senders.keys) return "no keys: only this machine may connect";
  return std::to_string(listeners.allowed.size()) + " keys may connect, " + std::to_string(senders.allowed.size()) +
         " of them may send frames";
}

/// Of all models. Nothing when one cannot be opened.
std::vector<NamedModel> check_models(Preflight& preflight, const ServeOptions& options) {
  std::vector<NamedModel> models;
  const bool is_one = !options.has_several_components();
  for (const std::string& file : options.model_files)
    preflight.check(is_one ? "model" : "model " + component_name(file), [&] {
      models.push_back({component_name(file), file, Model::open(io::path_of(file))});
      return describe(models.back().model, file);
    });
  if (models.size() != options.model_files.size()) return {};
  if (!is_one)
    preflight.check("components", [&] {
      std::vector<ComponentModel> components;
      for (const NamedModel& served : models) {
        require_beside(served, std::span(models).first(components.size()));
        components.push_back({served.name, served.model});
      }
      return coupling_text(components);
    });
  return models;
}

std::string describe_fit(const ServeOptions& options, const Model& model) {
  const MatcherConfig& config = options.matcher;
  if (options.has_several_rigs()) {
    const RigMatcher matcher(model, config, matched_rigs(options.rigs, config, model));
    return "the matcher has depth images for " + std::to_string(options.rigs.size()) + " rigs";
  }
  const Matcher matcher(model, config, views_for(options.rigs.front(), config, model));
  return "the matcher has depth images for this pose";
}

void check_endpoints(Preflight& preflight, const ServeOptions& options) {
  wire::ServerAccess senders, access;
  preflight.check("keys", [&] {
    senders = options.access.load();
    access = options.access.load_for_listeners();
    return describe(senders, access);
  });
  wire::WireContext context;
  std::vector<wire::FrameSource> frames;
  std::optional<wire::ResultSink> results, preview, inference;
  for (const NamedRig& rig : options.rigs)
    preflight.check(rig.name.empty() ? "frames" : "frames of " + rig.name,
                    [&] { return frames.emplace_back(context, rig.endpoint, wire::WireLimits{}, senders).endpoint(); });
  const auto bind = [&](const char* name, std::optional<wire::ResultSink>& sink, const std::string& endpoint) {
    preflight.check(name, [&] { return sink.emplace(context, endpoint, wire::results_held, access).endpoint(); });
  };
  bind("results", results, options.results_endpoint);
  if (!options.preview_endpoint.empty()) bind("preview", preview, options.preview_endpoint);
  if (!options.inference_endpoint.empty()) bind("inference", inference, options.inference_endpoint);
  if (!options.metrics_address.empty())
    preflight.check("metrics", [&] {
      return http::MetricsServer(options.metrics_address, [] { return std::string(); }).address();
    });
}

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

}  // namespace

int check(ServeOptions options) {
  Preflight preflight;
  const std::vector<NamedModel> models = check_models(preflight, options);
  if (!models.empty() && !options.rig_options.poses.empty())
    preflight.check("pose",
                    [&] { return read_poses(options, models.front().model), joined(options.rig_options.poses); });
  if (!models.empty()) {
    choose_method(options, models);
    std::vector<Finding> findings = check_options(options, models.front().model);
    if (std::ranges::find(findings, "method", &Finding::name) == findings.end())
      preflight.add({"method", Finding::Level::ok, name_of(options.matcher.method)});
    for (Finding& finding : findings) preflight.add(std::move(finding));
  }
  if (options.matcher.method == Method::fit)
    for (const NamedModel& served : models)
      preflight.check(options.has_several_components() ? "fit " + served.name : "fit",
                      [&] { return describe_fit(options, served.model); });
  if (!models.empty() && !options.inferred_field.empty())
    preflight.check("infer", [&] {
      const auto fields = fields_to_infer(options, models);
      return "field " + std::to_string(fields.front().field) + ", " + options.inferred_field;
    });
  check_endpoints(preflight, options);
  const bool records = !options.recording.file.empty();
  const std::uint64_t ring_bytes = records ? std::uint64_t{options.recording.memory_mb} << 20 : 0;
  std::uint64_t model_bytes = 0;
  for (const NamedModel& served : models) model_bytes += served.model.hot_bytes(options.matcher.method);
  preflight.add(check_memory(queue_bytes(options) + model_bytes + ring_bytes));
  for (Finding& finding : check_privileges(options.privileges, options.pipeline.matchers,
                                           models.empty() ? nullptr : &models.front().model, options.matcher.method))
    preflight.add(std::move(finding));
  for (Finding& finding : system::check_clock()) preflight.add(std::move(finding));
  for (Finding& finding : system::check_descriptors()) preflight.add(std::move(finding));
  if (records) {
    preflight.check("record", [&] { return check_recording(options.recording), options.recording.file; });
    const auto folder = std::filesystem::absolute(io::path_of(options.recording.file)).parent_path();
    preflight.add(check_disk(folder, probe_bytes));
  }
  std::printf("%s\n", (options.json ? preflight.to_json() : preflight.to_text()).c_str());
  return preflight.passed() ? exit_ok : exit_failed;
}

}  // namespace lbea::tool
