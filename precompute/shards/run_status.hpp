// How far each run of a plan is, as the work folder shows it.
#pragma once

#include "precompute/shards/bake_plan.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace lbea {

enum class RunProgress { waiting, running, finished, failed };

struct RunStatus {
  RunProgress progress = RunProgress::waiting;
  std::string reason;  // of a failure
};

/// One per run. A run counts as running while somebody writes to its files; where the writer died it counts as waiting
/// after `patience_s` seconds.
[[nodiscard]] std::vector<RunStatus> run_status(const WorkFolder& work, const BakePlan& plan, double patience_s = 300);

}  // namespace lbea
