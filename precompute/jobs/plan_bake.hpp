// The first of a bake's three steps: survey the runs, choose reference and region, solve for the bases.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/bake_plan.hpp"

#include <cstdint>

namespace lbea::bake {

/// One of `of` processes that share the work, counted from 0.
struct Shard {
  std::uint32_t index = 0, of = 1;

  [[nodiscard]] bool has(std::size_t run) const noexcept { return run % of == index; }
};

/// Throws Error{bad_config} when it is none of its number.
void check(const Shard& shard);

/// Surveys a share of the runs, for plan_bake() to find: the part of it that reads. What is there already is not read.
void survey_shard(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& description,
                  const Shard& shard, const BakeOptions& options);

/// Method steps 2 and 5. Surveys what has not been, and writes the plan. The work folder is created.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
[[nodiscard]] BakePlan plan_bake(const WorkFolder& work, const Ensemble& ensemble,
                                 const EnsembleDescription& description, const BakeOptions& options);

}  // namespace lbea::bake
