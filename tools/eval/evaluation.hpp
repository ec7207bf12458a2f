// The evaluation of the preprint: bakes the simulations S, senses the experiments E and matches their frames with every
// method, for every split, mode and disturbance.
#pragma once

#include "precompute/bake.hpp"
#include "tools/eval/experiments.hpp"
#include "tools/eval/trial.hpp"

#include <functional>

namespace lbea::tool {

struct EvaluationPlan {
  bake::EnsembleDescription description;     // of all runs; region.node_ids and views are filled
  bake::Ensemble ensemble;                   // all runs
  std::vector<Split> splits;                 // S and E; each is baked and tested separately
  std::vector<Experiment> more_experiments;  // not runs of the ensemble; tested with every split
  std::vector<ReferenceMode> modes{ReferenceMode::impact};
  std::vector<Disturbance> disturbances;        // tested in addition to undisturbed frames
  std::vector<std::uint32_t> removed_branches;  // each is left out of S once; its runs are the experiments
  bool contained = true;                        // also with E in S: a perfect match is possible
  bool other_components = true;                 // also other components, which no simulation should fit
  bool icp = true;
  TrialSettings trial;            // settings without a disturbance
  std::filesystem::path scratch;  // folder for models while they are baked
  unsigned threads = 0;           // 0: all processors
};

/// Experiments tested under the same conditions.
struct Round {
  std::string title;  // "unseen", "contained", "branch 1 removed", "branch 1 present", "other component"
  ReferenceMode mode = ReferenceMode::impact;
  Disturbance disturbance{};
  std::vector<TestTrial> tests;
};

struct Evaluation {
  std::vector<Round> rounds;
  std::vector<bake::BakeSummary> bakes;
  std::uint32_t branches = 1;
  std::optional<Model> model;  // of the first split
  std::string length_unit, field;
  bool complete = false;  // false: stopped by the caller
};

struct EvaluationCallbacks {
  std::function<void(std::string_view what, std::uint64_t done, std::uint64_t total)>
      progress;  // never called concurrently
  std::function<bool()> stopped;
};

/// Throws the errors of bake_model() and of the matcher. When stopped, returns what has been measured so far.
[[nodiscard]] Evaluation evaluate(const EvaluationPlan& plan, const EvaluationCallbacks& callbacks);

}  // namespace lbea::tool
