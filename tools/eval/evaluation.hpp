// The preprint's evaluation: bake S, sense E, match with every method, for every split, mode and disturbance.
#pragma once

#include "precompute/bake.hpp"
#include "tools/eval/score.hpp"
#include "tools/eval/split.hpp"
#include "tools/eval/trial.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

struct EvaluationPlan {
  bake::EnsembleDescription description;     // of all runs; region.node_ids and views are ready
  bake::Ensemble ensemble;                   // all runs
  std::vector<Split> splits;                 // S and E, each baked and tested on its own
  std::vector<Experiment> more_experiments;  // that are no runs of the ensemble, tested with every split
  std::vector<ReferenceMode> modes{ReferenceMode::impact};
  std::vector<Disturbance> disturbances;        // beside the undisturbed round
  std::vector<std::uint32_t> removed_branches;  // each is left out of S once and plays the experiments
  bool contained = true;                        // also with E in S: "perfect match possible"
  bool strangers = true;                        // also other components, which no simulation should fit
  bool icp = true;
  TrialSettings trial;            // of the undisturbed round
  std::filesystem::path scratch;  // folder for models while they are open
  unsigned threads = 0;           // 0: all processors
};

/// Experiments tested under the same conditions.
struct Round {
  std::string title;  // "unseen", "contained", "branch 1 removed", "branch 1 present", "other component"
  ReferenceMode mode = ReferenceMode::impact;
  Disturbance disturbance{};
  std::vector<TestTrial> tests;
};

/// The joint low-dimensional view (method step 8): the simulations of one model, to be drawn with the frames'
/// coordinates.
struct ViewPoint {
  std::string simulation;
  std::uint32_t branch = 0;
  std::uint32_t time_step = 0;
  double time_s = 0;
  std::array<float, 3> coordinates{};
  std::vector<double> parameters;
};

struct Evaluation {
  std::vector<Round> rounds;
  std::vector<bake::BakeSummary> bakes;
  std::uint32_t branches = 1;
  std::vector<ViewPoint> view;  // of the first split's model
  std::vector<std::string> parameter_names;
  std::string length_unit, field, field_unit;
  bool complete = false;  // false: stopped by the caller
};

struct EvaluationCallbacks {
  std::function<void(std::string_view what, std::uint64_t done, std::uint64_t total)> progress;  // one call at a time
  std::function<bool()> stopped;
};

/// Throws what bake() and the matcher's set-up throw. Stopped: what has been measured so far.
[[nodiscard]] Evaluation evaluate(const EvaluationPlan& plan, const EvaluationCallbacks& callbacks);

}  // namespace lbea::tool
