// How large and how long, before the work starts.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/bake_plan.hpp"

#include <cstddef>
#include <cstdint>

namespace lbea::bake {

struct BakeEstimate {
  std::size_t runs = 0, samples = 0;
  std::uint64_t model_bytes = 0;   // exact, when no run fails
  std::uint64_t hot_bytes = 0;     // of the model: what has to fit into memory for matching by lbea and fit
  std::uint64_t work_bytes = 0;    // of the work folder beside it: within 1 % and some kB per run
  double seconds_per_sample = 0;   // of one thread; measured on the first samples of the reference run, just now
  std::uint64_t shared_bytes = 0;  // memory of a shard: the bases,
  std::uint64_t thread_bytes = 0;  // and what each thread needs beside its reader, about
};

/// Throws Error{write_failed} when the disk that holds `work` has no room for the records and the model.
void check_space(const WorkFolder& work, const BakePlan& plan);

/// Throws what a shard throws.
[[nodiscard]] BakeEstimate estimate(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options);

}  // namespace lbea::bake
