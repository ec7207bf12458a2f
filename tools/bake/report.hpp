// What a bake made, will make and is making, for people and for programs.
#pragma once

#include "precompute/bake_summary.hpp"
#include "precompute/jobs/bake_shard.hpp"
#include "precompute/jobs/estimate.hpp"
#include "precompute/jobs/run_status.hpp"

#include <filesystem>
#include <vector>

namespace lbea::tool {

void print_table(const bake::BakeSummary& summary, const std::filesystem::path& model);
void print_json(const bake::BakeSummary& summary, const std::filesystem::path& model);

void print_table(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);
void print_json(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);

void print_table(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);
void print_json(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);

void print_table(const bake::ShardSummary& summary);

}  // namespace lbea::tool
