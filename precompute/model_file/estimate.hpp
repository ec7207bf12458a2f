// Size and duration of a bake, before the work starts.
#pragma once

#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
struct BakeEstimate {
  std::size_t runs = 0, samples = 0;
  std::uint64_t model_bytes = 0;   // exact, when no run fails
  std::uint64_t hot_bytes = 0;     // of the model: must fit into memory for matching by methods lbea and fit
  std::uint64_t work_bytes = 0;    // of the work folder: within 1 % and some kB per run
  double seconds_per_sample = 0;   // of one thread; measured on the first samples of the reference run
  std::uint64_t shared_bytes = 0;  // memory of a shard: the bases,
  std::uint64_t thread_bytes = 0;  // and about this much per thread, without its reader
};

/// Throws Error{write_failed} when the disk of `work` has too little space for the work files and the model.
void check_space(const WorkFolder& work, const BakePlan& plan);

/// Throws what a shard throws.
[[nodiscard]] BakeEstimate estimate(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options);
}  // namespace lbea::bake
