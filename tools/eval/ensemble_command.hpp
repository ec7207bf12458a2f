// lbea-eval ensemble: the choice of experiments, sensing and methods.
#pragma once

#include "tools/eval/evaluation.hpp"
#include "tools/shared/cli/tool.hpp"

namespace lbea::tool {

struct EnsembleArguments {
  std::filesystem::path toml, sensor, out;
  std::vector<std::filesystem::path> more_rigs;
  double share = 0.2;
  std::vector<std::string> experiments;  // names of runs, or paths of runs outside the ensemble
  bool leave_one_out = false;
  std::uint32_t folds = 0;  // 0: one split
  std::string mode = "impact";
  Disturbance own{.name = "as requested"};
  bool robustness = false, meshes = false, json = false;
  EvaluationPlan plan;  // its settings that have options; the others are derived from the above
};

void declare(CommandLine& app, EnsembleArguments& arguments);

/// Runs the evaluation, prints its tables and writes its files.
int evaluate_ensemble(const EnsembleArguments& arguments);

}  // namespace lbea::tool
