// lbea-eval ensemble: the choice of experiments, sensing and methods.
#pragma once

#include "tools/shared/cli/tool.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lbea::tool {

struct EnsembleArguments {
  std::filesystem::path toml, sensor, out;
  double share = 0.2;
  std::vector<std::string> experiments;  // names of runs, or paths of runs outside the ensemble
  bool leave_one_out = false;
  std::uint32_t folds = 0;  // 0: one split
  std::string mode = "impact";
  std::uint32_t first_step = 2, every = 1;
  std::uint64_t seed = 1;
  double noise = -1, outliers = -1;  // negative: those of the sensor
  double hidden = 0, connected = 0, thinned = 1, pose_error_deg = 0;
  bool same_place = false;
  bool robustness = false, contained = true, icp = true, other_components = true, meshes = false, json = false;
  std::vector<std::uint32_t> removed_branches;
  unsigned threads = 0;
};

void declare(CommandLine& app, EnsembleArguments& arguments);

/// Runs the evaluation, prints its tables and writes its files.
int evaluate_ensemble(const EnsembleArguments& arguments);

}  // namespace lbea::tool
