// Summary, estimate and status of a bake, as tables and as JSON.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/jobs/jobs.hpp"
#include "precompute/model_file/estimate.hpp"

namespace lbea::tool {

void print_table(const bake::BakeSummary& summary, const std::filesystem::path& model);
void print_json(const bake::BakeSummary& summary, const std::filesystem::path& model);

void print_table(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);
void print_json(const bake::BakePlan& plan, const bake::BakeEstimate& estimate);

void print_table(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);
void print_json(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs);

void print_table(const bake::ShardSummary& summary);

}  // namespace lbea::tool
