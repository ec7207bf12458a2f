// The second of a bake's three steps: each process makes the records of its runs.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/plan_bake.hpp"

#include <cstddef>

namespace lbea::bake {

struct ShardSummary {
  std::size_t runs = 0;      // of this shard
  std::size_t finished = 0;  // before
  std::size_t renewed = 0;   // whose record was there: only what depends on the whole ensemble's place was made
  std::size_t failed = 0;    // reasons are in the work folder
};

/// What is finished is not done again; what is not leaves nothing under its final name, whenever the process dies. Any
/// number of processes may work at once, with any division into shards.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled.
ShardSummary bake_shard(const WorkFolder& work, const BakePlan& plan, const Shard& shard, const BakeOptions& options);

}  // namespace lbea::bake
