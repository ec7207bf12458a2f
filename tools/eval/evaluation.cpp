#include "tools/eval/evaluation.hpp"

#include "precompute/parallel.hpp"
#include "tools/eval/truth.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/views/views.hpp"

#include <map>
#include <numeric>

namespace lbea::tool {
namespace {

std::vector<std::size_t> all_runs(const bake::Ensemble& ensemble) {
  std::vector<std::size_t> runs(ensemble.runs.size());
  std::iota(runs.begin(), runs.end(), std::size_t{0});
  return runs;
}

class Evaluator {
 public:
  Evaluator(const EvaluationPlan& plan, const EvaluationCallbacks& callbacks) : plan_(plan), callbacks_(callbacks) {}

  Evaluation run() {
    try {
      learn_branches();
      for (const std::uint32_t branch : plan_.removed_branches) check_branch(branch);
      for (const ReferenceMode mode : plan_.modes) {
        for (const Split& split : plan_.splits)
          if (!stopped()) test_split(split, mode);
        if (plan_.contained && !stopped()) test_contained(mode);
      }
      for (const std::uint32_t branch : plan_.removed_branches)
        if (!stopped()) test_removed_branch(branch, plan_.modes.front());
    } catch (const bake::BakeCancelled&) { return std::move(result_); }
    result_.complete = !stopped();
    return std::move(result_);
  }

 private:
  using Runs = std::span<const std::size_t>;

  [[nodiscard]] TestSetup bake_runs(Runs runs, ReferenceMode mode) {
    bake::EnsembleDescription description = plan_.description;
    description.mode = mode;
    bake::BakeOptions options;
    options.threads = plan_.threads;
    options.visible_nodes = visibility(description.region);
    add_depth_renderers(options, description);
    options.cancelled = [this] { return stopped(); };
    const std::string title = "bake " + std::to_string(baked_ + 1) + ", ";
    options.progress = [&](const bake::BakeProgress& stage) {
      callbacks_.progress(title + std::string(stage.stage), stage.done, stage.total);
    };
    const auto file = plan_.scratch / ("split_" + std::to_string(baked_++) + ".lbea");
    const bake::Ensemble ensemble = subset(plan_.ensemble, runs);
    result_.bakes.push_back(bake::bake_model(ensemble, description, file, options));
    TestSetup setup{Model::open(file), result_.bakes.back().channels};
    std::filesystem::remove(file);  // the mapping remains valid
    if (description.rigid.are_set)
      setup.frame = std::make_shared<bake::BodyFrame>(ensemble.runs[ensemble.reference_run].open, description.rigid);
    return setup;
  }

  void learn_branches() {
    full_ = bake_runs(all_runs(plan_.ensemble), ReferenceMode::impact);
    result_.branches = full_->model.branches();
    result_.length_unit = full_->model.length_unit();
    if (full_->model.fields() > 0) result_.field = full_->model.field(0).name;
  }

  void test_split(const Split& split, ReferenceMode mode) {
    const TestSetup setup = bake_runs(split.simulations, mode);
    fold_ = plan_.splits.size() > 1 ? static_cast<std::uint32_t>(&split - plan_.splits.data()) + 1 : 0;
    if (!result_.model) result_.model = setup.model;
    std::vector<Experiment> tested = experiments(split.experiments);
    tested.insert(tested.end(), plan_.more_experiments.begin(), plan_.more_experiments.end());
    test_disturbed("unseen", setup, mode, tested);
    if (mode != plan_.modes.front() || !plan_.other_components || &split != &plan_.splits.front()) return;
    TestSetup as_built = setup;
    as_built.frame.reset();
    test(round("other component", mode), as_built, other_components(setup.model));
  }

  void test_contained(ReferenceMode mode) {
    const TestSetup setup = mode == ReferenceMode::impact ? *full_ : bake_runs(all_runs(plan_.ensemble), mode);
    if (const auto tested = all_experiments(); !tested.empty()) test_disturbed("contained", setup, mode, tested);
  }

  /// With undisturbed frames; in the first mode also with ICP and with disturbed frames.
  void test_disturbed(const char* title, const TestSetup& setup, ReferenceMode mode,
                      std::span<const Experiment> tested) {
    const bool is_first = mode == plan_.modes.front();
    TestSetup undisturbed = setup;
    if (plan_.icp && is_first) undisturbed.icp = std::make_shared<IcpBaseline>(setup.model);
    test(round(title, mode), std::move(undisturbed), tested);
    for (const Disturbance& disturbance : plan_.disturbances)
      if (is_first && !stopped()) test(round(title, mode, disturbance), setup, tested);
  }

  void check_branch(std::uint32_t branch) const {
    if (branch < result_.branches && result_.branches > 1) return;
    throw Error(Status::bad_config, "branch " + std::to_string(branch) + " cannot be left out: the ensemble has " +
                                        std::to_string(result_.branches) +
                                        " branches, numbered from 0, and one must remain");
  }

  // Tests runs of the branch with S without the branch, then with S that has the other runs of the branch. The tested
  // runs are those in E; if there are none, the first four.
  void test_removed_branch(std::uint32_t branch, ReferenceMode mode) {
    std::vector<std::size_t> inside, outside;
    for (std::size_t run = 0; run < plan_.ensemble.runs.size(); ++run)
      (full_->model.branch_of(static_cast<std::uint32_t>(run)) == branch ? inside : outside).push_back(run);
    if (inside.empty() || outside.empty()) return;
    std::vector<std::size_t> tested, present;
    for (const Split& split : plan_.splits)
      for (const std::size_t run : split.experiments)
        if (std::ranges::find(inside, run) != inside.end()) tested.push_back(run);
    if (tested.empty() || plan_.splits.size() > 1) {
      tested = inside;
      tested.resize(std::min<std::size_t>(inside.size(), 4));
    }
    for (std::size_t run = 0; run < plan_.ensemble.runs.size(); ++run)
      if (std::ranges::find(tested, run) == tested.end()) present.push_back(run);
    const std::string name = "branch " + std::to_string(branch);
    test(round(name + " removed", mode), bake_runs(outside, mode), experiments(tested));
    if (stopped()) return;
    test(round(name + " present", mode), bake_runs(present, mode), experiments(tested));
  }
  void test(Round& round, TestSetup setup, std::span<const Experiment> experiments) {
    TrialSettings settings = plan_.trial;
    setup.more_views = views_of_rigs(setup.model);
    settings.disturbance = round.disturbance;
    settings.mapping = plan_.description.mapping;
    const bool plainly_unseen =
        round.title == "unseen" && round.disturbance.name == Disturbance{}.name && round.mode == plan_.modes.front();
    if (!plainly_unseen) settings.meshes.clear();
    std::vector<TestTrial> tests(experiments.size());
    std::uint64_t frames = 0, total = 0;
    for (const Experiment& experiment : experiments)
      for (std::uint32_t step = settings.first_step, states = experiment.open()->states(); step < states;
           step += settings.every)
        ++total;
    if (total == 0)
      throw Error(Status::bad_config, "no experiment has a state from step " + std::to_string(settings.first_step) +
                                          " on; give a smaller --first-step");
    const std::string title =
        round.title + (round.mode == ReferenceMode::impact ? "" : ", over time") + ", " + round.disturbance.name;
    bake::work_in_parallel(experiments.size(), plan_.threads, [&](const auto& next) {
      for (std::size_t i = next(); i < experiments.size() && !stopped(); i = next()) {
        tests[i] = run_test(setup, experiments[i], settings, [&] {
          const std::lock_guard lock(mutex_);
          callbacks_.progress(title, ++frames, total);
          return stopped();
        });
        tests[i].branch = branch_of(setup, experiments[i]);
        if (tests[i].forecast) tests[i].forecast->parameters = parameters_of(experiments[i]);
        tests[i].fold = round.title == "unseen" ? fold_ : 0;
      }
    });
    for (TestTrial& done : tests)
      if (!done.frames.empty()) round.tests.push_back(std::move(done));
  }

  /// Of the rigs beside the first one, rendered once per model.
  [[nodiscard]] const std::vector<SensorViews>& views_of_rigs(const Model& model) {
    if (plan_.trial.more_rigs.empty() || rendered_for_ == model.checksum()) return more_views_;
    more_views_.clear();
    for (const io::SensorDescription& rig : plan_.trial.more_rigs) more_views_.push_back(rendered(model, rig.sensor));
    rendered_for_ = model.checksum();
    return more_views_;
  }
  [[nodiscard]] std::vector<Experiment> experiments(Runs runs) const {
    std::vector<Experiment> chosen;
    for (const std::size_t run : runs) chosen.push_back({plan_.ensemble.runs[run].name, plan_.ensemble.runs[run].open});
    return chosen;
  }
  [[nodiscard]] std::vector<Experiment> all_experiments() const {
    std::vector<std::size_t> runs;
    for (const Split& split : plan_.splits) runs.insert(runs.end(), split.experiments.begin(), split.experiments.end());
    std::ranges::sort(runs);
    runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
    return experiments(runs);
  }

  [[nodiscard]] std::vector<double> parameters_of(const Experiment& experiment) const {
    const auto found = std::ranges::find(plan_.ensemble.runs, experiment.name, &bake::EnsembleRun::name);
    return found == plan_.ensemble.runs.end() ? std::vector<double>() : found->parameters;
  }
  // The branch of a run of the ensemble is known. Another run gets the branch of the simulation that has the sample
  // nearest to the last state of the run.
  [[nodiscard]] std::uint32_t branch_of(const TestSetup& setup, const Experiment& experiment) const {
    const auto found = std::ranges::find(plan_.ensemble.runs, experiment.name, &bake::EnsembleRun::name);
    if (found != plan_.ensemble.runs.end())
      return full_->model.branch_of(static_cast<std::uint32_t>(found - plan_.ensemble.runs.begin()));
    const auto reader = setup.opened(experiment);
    if (reader->states() == 0) return 0;
    bake::SimulationState state;
    reader->read(reader->states() - 1, state);
    std::vector<float> truth;
    TrueMesh(reader->mesh(), full_->model, plan_.description.mapping).positions(state.positions, truth);
    return full_->model.branch_of(full_->model.sample(oracle(full_->model, truth).sample).simulation);
  }
  [[nodiscard]] Round& round(const std::string& title, ReferenceMode mode, const Disturbance& disturbance = {}) {
    const auto [at, fresh] = round_indices_.emplace(
        title + '/' + std::to_string(static_cast<int>(mode)) + '/' + disturbance.name, result_.rounds.size());
    if (fresh) result_.rounds.push_back({title, mode, disturbance, {}});
    return result_.rounds[at->second];
  }
  [[nodiscard]] bool stopped() const { return callbacks_.stopped(); }

  const EvaluationPlan& plan_;
  const EvaluationCallbacks& callbacks_;
  Evaluation result_;
  std::optional<TestSetup> full_;  // of all runs, at impact; defines the branches
  std::map<std::string, std::size_t> round_indices_;
  std::vector<SensorViews> more_views_;
  std::uint64_t rendered_for_ = 0;  // checksum of the model
  std::mutex mutex_;
  int baked_ = 0;
  std::uint32_t fold_ = 0;  // of the last split; from 1, 0: it is the only one
};

}  // namespace

Evaluation evaluate(const EvaluationPlan& plan, const EvaluationCallbacks& callbacks) {
  return Evaluator(plan, callbacks).run();
}

}  // namespace lbea::tool
