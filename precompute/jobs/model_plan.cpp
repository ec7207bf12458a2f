#include "precompute/jobs/model_plan.hpp"

#include "precompute/model_file/provenance.hpp"

#include <lbea/lbea.hpp>

namespace lbea::bake {

ModelPlan plan_model(const BakePlan& plan, const std::vector<ReferenceBasis>& bases, const EnvelopeGrid& envelope,
                     const std::vector<std::string>& left_out) {
  ModelPlan model;
  model.info = model_info(plan.description, plan.ensemble, plan.survey, bases, envelope);
  model.small = small_sections(model.info, plan.description, plan.ensemble, plan.survey, bases, envelope);
  // Its length is planned before the kept variance is known; blanks fill what is left.
  model.provenance_size = provenance_json(plan.description, plan.ensemble, plan.survey, bases, 0, left_out).size() + 32;
  model.small.plan(model.sections);
  plan_large_sections(model.sections, model.info, plan.description, model.provenance_size,
                      plan.camera ? &*plan.camera : nullptr);
  return model;
}

BakePlan without_runs(const BakePlan& plan, const std::vector<bool>& is_kept) {
  BakePlan kept = plan;
  kept.ensemble.runs.clear();
  kept.survey.runs.clear();
  kept.runs.clear();
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    if (!is_kept[run]) continue;
    if (run == plan.ensemble.reference_run) kept.ensemble.reference_run = kept.runs.size();
    kept.ensemble.runs.push_back(plan.ensemble.runs[run]);
    kept.survey.runs.push_back(plan.survey.runs[run]);
    kept.runs.push_back(plan.runs[run]);
  }
  return kept;
}

}  // namespace lbea::bake
