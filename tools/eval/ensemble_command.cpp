#include "tools/eval/ensemble_command.hpp"

#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/simulation/open.hpp"
#include "tools/eval/evaluation_report.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/system/scratch_folder.hpp"
#include "tools/shared/text/printable.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace lbea::tool {
namespace {

// Each disturbance alone, then all of them.
std::vector<Disturbance> robustness_rows() {
  return {{.name = "30 % of the surface hidden in patches", .hidden = 0.3},
          {.name = "30 % hidden by one patch, another one per frame", .connected = 0.3},
          {.name = "30 % hidden by one patch, the same place for the test", .connected = 0.3, .same_place = true},
          {.name = "2 % outliers", .outliers = 0.02f},
          {.name = "0.5 noise", .noise = 0.5f},
          {.name = "smeared by windows of 11 pixels", .window = 11},
          {.name = "a third of the points", .kept = 1.0 / 3},
          {.name = "3 degrees of pose error", .pose_error_deg = 3},
          {.name = "5 of pose error", .pose_error = 5},
          {.name = "3 degrees and 10 of pose error", .pose_error_deg = 3, .pose_error = 10},
          {.name = "drift to 3 degrees and 8 of pose error", .pose_error_deg = 3, .pose_error = 8, .is_drifting = true},
          {.name = "patches, outliers, noise, fewer points and pose error",
           .noise = 0.5f,
           .outliers = 0.02f,
           .hidden = 0.3,
           .kept = 1.0 / 3,
           .pose_error_deg = 3}};
}

void choose_experiments(const EnsembleArguments& arguments, EvaluationPlan& plan) {
  const auto& runs = plan.ensemble.runs;
  const std::uint64_t seed = plan.trial.seed;
  if (arguments.leave_one_out) return void(plan.splits = leave_one_out(runs.size()));
  if (arguments.folds > 0) return void(plan.splits = folds(runs.size(), arguments.folds, seed));
  if (arguments.experiments.empty()) return void(plan.splits = {random_split(runs.size(), arguments.share, seed)});
  std::vector<std::string> inside;
  for (const std::string& name : arguments.experiments) {
    if (std::ranges::find(runs, name, &bake::EnsembleRun::name) != runs.end() || !std::filesystem::exists(name))
      inside.push_back(name);
    else
      plan.more_experiments.push_back({run_name(name), [name] { return io::open_simulation(name); }});
  }
  plan.splits = {named_split(runs, inside)};
}

bool disturbs(const Disturbance& own) {
  return own.hidden > 0 || own.connected > 0 || own.window > 0 || own.kept < 1 || own.pose_error_deg > 0 ||
         own.pose_error > 0 || own.noise || own.outliers;
}

EvaluationPlan planned(const EnsembleArguments& arguments, const std::filesystem::path& scratch) {
  EvaluationPlan plan = arguments.plan;
  plan.description = io::read_ensemble_toml(arguments.toml);
  std::vector<std::filesystem::path> rigs = rigs_of(plan.description);
  if (rigs.empty()) {
    rigs = arguments.more_rigs;
    rigs.insert(rigs.begin(), arguments.sensor);
  }
  complete_region(plan.description.region, rigs);
  plan.description.depth_sensor = arguments.sensor;
  plan.description.more_depth_sensors.clear();  // the trial renders them
  plan.ensemble = open_ensemble(plan.description);
  choose_experiments(arguments, plan);
  if (arguments.mode == "over-time") plan.modes = {ReferenceMode::over_time};
  if (arguments.mode == "both") plan.modes = {ReferenceMode::impact, ReferenceMode::over_time};
  if (arguments.robustness) plan.disturbances = robustness_rows();
  if (disturbs(arguments.own)) plan.disturbances.push_back(arguments.own);
  plan.trial.sensor = io::read_sensor_json(arguments.sensor);
  for (const auto& rig : arguments.more_rigs) plan.trial.more_rigs.push_back(io::read_sensor_json(rig));
  plan.trial.impact_step = plan.description.impact_step;
  plan.trial.time_factor = plan.description.time_factor;
  if (arguments.meshes) plan.trial.meshes = arguments.out / "meshes";
  plan.scratch = scratch;
  return plan;
}

/// A number in this range. Unlike in_range() it refuses NaN.
Check between(double least, double most) {
  const auto check = [least, most](const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool is_inside = !text.empty() && *end == '\0' && value >= least && value <= most;
    return is_inside ? std::string()
                     : text + " is not between " + std::to_string(least).substr(0, 8) + " and " +
                           std::to_string(most).substr(0, 8);
  };
  return {check, ""};
}

void declare_disturbance(CommandLine& app, Disturbance& own) {
  const auto add = [&](const char* name, auto& value, double most, const char* help) {
    return app.add_option(name, value, help)->check(between(0, most))->group("An additional round of disturbed frames");
  };
  add("--hide", own.hidden, 1, "share of the surface that patches hide");
  auto* connected = add("--hide-connected", own.connected, 1,
                        "share of the points that one patch hides, at another place in every frame");
  app.add_flag("--same-place", own.same_place, "the connected patch stays at one place for the whole test")
      ->needs(connected)
      ->group("An additional round of disturbed frames");
  add("--smear", own.window, 99,
      "side in pixels of the windows of stereo matching, which smear depths and lose points at edges");
  add("--thin", own.kept, 1, "share of the points that remain");
  add("--pose-error", own.pose_error_deg, 180, "turn in degrees about a random axis through the component's middle");
  add("--shift", own.pose_error, 1e6, "shift in a random direction, length unit");
  app.add_flag("--drift", own.is_drifting, "turn and shift grow during the test, from nothing to these values")
      ->group("An additional round of disturbed frames");
  add("--noise", own.noise, 1e6, "standard deviation along the line of sight, length unit (default: sensor.json's)");
  add("--outliers", own.outliers, 1, "share of points that are outliers (default: sensor.json's)");
}

}  // namespace

void declare_experiments(CommandLine& app, EnsembleArguments& arguments) {
  auto* share =
      app.add_option("--split", arguments.share, "share of the runs that are experiments, chosen at random by --seed");
  auto* named = app.add_option("--experiments", arguments.experiments,
                               "the runs that are experiments: names, or paths of runs outside the ensemble")
                    ->delimiter(',')
                    ->excludes(share)
                    ->default_text("");
  app.add_flag("--leave-one-out", arguments.leave_one_out,
               "every run once as the experiment, with all others as simulations")
      ->excludes(share)
      ->excludes(named);
  app.add_option("--folds", arguments.folds, "every run once as an experiment, in this number of splits")
      ->check(positive_number())
      ->excludes(share)
      ->excludes(named)
      ->default_text("");
}

void declare_rounds(CommandLine& app, EvaluationPlan& plan) {
  app.add_option("--remove-branch", plan.removed_branches,
                 "also without this deformation branch among the simulations: is it reported that no simulation fits?")
      ->delimiter(',')
      ->default_text("");
  app.add_flag("--icp,!--no-icp", plan.icp, "also the ICP baseline, which takes seconds per frame");
  app.add_flag("--contained,!--no-contained", plan.contained, "also with the experiments among the simulations");
  app.add_flag("--strangers,!--no-strangers", plan.other_components, "also frames of other components");
}

void declare_knowledge(CommandLine& app, EnsembleArguments& arguments) {
  app.add_flag("--fixed-pose{false}", arguments.plan.trial.estimate_pose,
               "do not estimate the pose error of each test");
  app.add_flag("--known-impact", arguments.plan.trial.knows_impact,
               "do not estimate the time of impact, as lbea-serve with --trigger-ns");
  app.add_flag("--frames-alone", arguments.plan.trial.frames_alone,
               "match each frame without what the earlier ones of its test have shown")
      ->excludes("--rig");
}

void declare(CommandLine& app, EnsembleArguments& arguments) {
  app.add_option("ENSEMBLE", arguments.toml, "ensemble.toml: all runs, simulations and experiments")->required();
  app.add_option("--sensor", arguments.sensor, "sensor.json: the rig that senses the experiments, and its noise")
      ->required();
  auto* rig = app.add_option("--rig", arguments.more_rigs,
                             "sensor.json of another rig, whose frames are fitted together with those of --sensor; "
                             "repeatable")
                  ->default_text("");
  app.add_option("-o,--out", arguments.out,
                 "folder for tables.md, summary.json, frames.csv, view.csv, worst.csv, worst/")
      ->required();
  declare_experiments(app, arguments);
  app.add_option("--mode", arguments.mode, "reference mesh: impact, over-time or both")
      ->check(one_of({"impact", "over-time", "both"}));
  app.add_option("--first-step", arguments.plan.trial.first_step, "first state of an experiment that is sensed");
  app.add_option("--every", arguments.plan.trial.every, "interval of the states that are sensed")
      ->check(positive_number());
  app.add_option("--seed", arguments.plan.trial.seed, "seed of the split, the noise and the disturbances");
  app.add_flag("--robustness", arguments.robustness,
               "also with disturbed frames: hidden, outliers, noise, thinned, pose error, all");
  declare_knowledge(app, arguments);
  declare_disturbance(app, arguments.own);
  app.add_flag("--first-rig-alone", arguments.plan.trial.disturbs_first_rig_alone,
               "the frames of the rigs given by --rig are not disturbed")
      ->needs(rig)
      ->group("An additional round of disturbed frames");
  app.add_option("--clock-offset", arguments.plan.trial.clock_offset_ms,
                 "ms that the clocks of the rigs given by --rig are behind, unknown to the matcher")
      ->check(between(-1e6, 1e6))
      ->needs(rig);
  declare_rounds(app, arguments.plan);
  app.add_flag("--meshes", arguments.meshes,
               "write the matched and estimated meshes of each unseen experiment for ParaView");
  app.add_option("--threads", arguments.plan.threads, "0: all processors; the errors do not depend on it");
  app.add_flag("--json", arguments.json, "print the summary as JSON");
}

int evaluate_ensemble(const EnsembleArguments& arguments) {
  catch_stop_signals();
  const ScratchFolder scratch(arguments.out);
  const EvaluationPlan plan = planned(arguments, scratch.path());
  StageProgress progress;
  const EvaluationCallbacks callbacks{
      [&](std::string_view what, std::uint64_t done, std::uint64_t total) { progress.show(what, done, total); },
      [] { return stop_requested != 0; }};
  const Evaluation evaluation = evaluate(plan, callbacks);
  write_evaluation(arguments.out, evaluation);
  std::printf("%s\n", (arguments.json ? to_json(evaluation) : printable(tables(evaluation), "\n")).c_str());
  if (evaluation.complete) return exit_ok;
  std::fprintf(stderr, "lbea-eval: stopped; %s holds the results so far\n", arguments.out.c_str());
  return exit_failed;
}

}  // namespace lbea::tool
