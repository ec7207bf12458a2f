// How far each run of a plan is, as the work folder shows it.
#pragma once

#include "precompute/jobs/bake_plan.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace lbea::bake {

enum class RunProgress { waiting, running, finished, failed };

struct RunStatus {
  RunProgress progress = RunProgress::waiting;
  std::string reason;  // of a failure
};

/// One per run. A run counts as running while a process writes its files; where the writer died on this machine it
/// counts as waiting at once, on another one after `patience_s` seconds without a sign.
[[nodiscard]] std::vector<RunStatus> run_status(const WorkFolder& work, const BakePlan& plan, double patience_s = 300);

}  // namespace lbea::bake
