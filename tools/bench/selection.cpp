#include "tools/bench/selection.hpp"

#include "tools/bench/fit/fit_answer.hpp"
#include "tools/shared/cli/progress.hpp"

#include <algorithm>
#include <cstdio>

namespace lbea::tool::bench {
namespace {

std::unique_ptr<Pipeline> make_product(const Selection& selection, const Model& model) {
  const auto& [config, extras, kernels_name, baselines] = selection;
  if (config.method == Method::fit) return fit_pipeline(model, config, extras);
  if (kernels_name.empty()) return matcher_pipeline(model, config);
  return kernels_pipeline(model, config, kernels_named(kernels_name), "lbea, " + kernels_name);
}

std::unique_ptr<Pipeline> make_baseline(const std::string& name, const Model& model, MatcherConfig config) {
  if (name == "portable") return kernels_pipeline(model, config, kernels_named("baseline"), name);
  if (name == "nanoflann")
    return config.method == Method::fit ? plain_fit_pipeline(model, config) : nanoflann_pipeline(model, config);
  config.method = Method::lbea;
  return matcher_pipeline(model, config);
}

}  // namespace

void check(const Selection& selection, const Model& model) {
  const bool is_fit = selection.matcher.method == Method::fit;
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Error(Status::bad_config, what);
  };
  const auto has = [&](const char* baseline) {
    return std::ranges::find(selection.baselines, baseline) != selection.baselines.end();
  };
  require(!is_fit || (selection.kernels_name.empty() && !has("portable")),
          "--method fit is measured with the fastest inner loops: leave out --kernels and the baseline portable");
  require(is_fit || !has("lbea"), "the baseline lbea is for --method fit");
  require(is_fit || (!selection.extras.tracks && !selection.extras.inferred), "--track and --infer need --method fit");
  require(!is_fit || model.view().depth_images != nullptr,
          "the model has no depth images for --method fit; bake it with --views sensor.json");
}

std::vector<std::unique_ptr<Pipeline>> make_pipelines(const Selection& selection, const Model& model) {
  std::vector<std::unique_ptr<Pipeline>> pipelines;
  pipelines.push_back(make_product(selection, model));
  for (const std::string& name : selection.baselines)
    pipelines.push_back(make_baseline(name, model, selection.matcher));
  return pipelines;
}

std::uint32_t field_named(const Model& model, const std::string& name) {
  std::string names;
  for (std::uint32_t field = 0; field < model.fields(); ++field) {
    if (model.field(field).name == name) return field;
    names += (names.empty() ? "" : ", ") + std::string(model.field(field).name);
  }
  throw Error(Status::bad_config, "--infer " + name + ": the model has " + (names.empty() ? "no fields" : names));
}

std::optional<std::size_t> check_answers(Pipelines pipelines, const Model& model, const MatcherConfig& config,
                                         std::span<const BenchCloud> clouds) {
  std::size_t hidden = 0;
  Progress progress("checking", clouds.size());
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    FrameCheck check(task_of(model, config), clouds[i].points);
    for (const auto& pipeline : pipelines) {
      const Answer answer = pipeline->answer(clouds[i].frame(i));
      hidden += answer.fit && answer.fit->is_hidden;
      const auto wrong = check.disagreement(answer);
      if (!wrong) continue;
      std::fprintf(stderr, "lbea-bench: %s: %s: %s\n", clouds[i].name.c_str(), pipeline->name().c_str(),
                   wrong->c_str());
      return {};
    }
    progress.advance_to(i + 1);
  }
  return hidden;
}

}  // namespace lbea::tool::bench
