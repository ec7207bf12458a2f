// The model that a plan's runs make, section by section, before any of it is written.
#pragma once

#include "precompute/jobs/bake_plan.hpp"
#include "precompute/model_file/model_sections.hpp"

#include <string>
#include <vector>

namespace lbea::bake {

struct ModelPlan {
  format::Info info{};
  SmallSections small;
  std::size_t provenance_size = 0;
  std::vector<PlannedSection> sections;
};

/// left_out: names, for the provenance; the plan has them no more.
[[nodiscard]] ModelPlan plan_model(const BakePlan& plan, const std::vector<ReferenceBasis>& bases,
                                   const EnvelopeGrid& envelope, const std::vector<std::string>& left_out);

/// The plan without some of its runs. is_kept: per run.
[[nodiscard]] BakePlan without_runs(const BakePlan& plan, const std::vector<bool>& is_kept);

}  // namespace lbea::bake
