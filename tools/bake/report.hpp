// What a bake made, will make and is making, for people and for programs.
#pragma once

#include "precompute/bake_summary.hpp"
#include "precompute/jobs/bake_shard.hpp"
#include "precompute/jobs/estimate.hpp"
#include "precompute/jobs/run_status.hpp"

#include <filesystem>
#include <vector>

namespace lbea {

void print_table(const BakeSummary& summary, const std::filesystem::path& model);
void print_json(const BakeSummary& summary, const std::filesystem::path& model);

void print_table(const BakePlan& plan, const BakeEstimate& estimate);
void print_json(const BakePlan& plan, const BakeEstimate& estimate);

void print_table(const BakePlan& plan, const std::vector<RunStatus>& runs);
void print_json(const BakePlan& plan, const std::vector<RunStatus>& runs);

void print_table(const ShardSummary& summary);

}  // namespace lbea
