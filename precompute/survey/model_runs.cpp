#include "precompute/survey/model_runs.hpp"

#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
namespace {

bool any(const std::vector<std::uint8_t>& of_elements) {
  return std::ranges::find(of_elements, 1) != of_elements.end();
}

/// Per element of the reference run: the runs read from their own files have it, one of them shows it, and the model
/// lacks it.
std::vector<std::uint8_t> doubtful_elements(const WorkFolder& work, const BakePlan& plan, std::size_t elements) {
  std::vector<std::uint8_t> is_shown(elements), is_missing(elements), is_lacking(elements);
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    if (!plan.runs[run].failure.empty()) continue;
    const std::vector<Presence> common = read_survey(work, plan.runs[run]).common;
    std::vector<std::uint8_t>& missing = plan.ensemble.runs[run].own ? is_lacking : is_missing;
    for (std::size_t e = 0; e < elements; ++e) {
      if (common.at(e) == Presence::missing) missing[e] = 1;
      if (common[e] == Presence::always || common[e] == Presence::sometimes) is_shown[e] = 1;
    }
  }
  for (std::size_t e = 0; e < elements; ++e) is_lacking[e] = is_lacking[e] & is_shown[e] & (is_missing[e] ^ 1u);
  return is_lacking;
}

}  // namespace

bool model_lacks_elements(const WorkFolder& work, const BakePlan& plan, const SimulationMesh& reference) {
  if (std::ranges::none_of(plan.ensemble.runs, [](const EnsembleRun& run) { return run.own != nullptr; })) return false;
  std::vector<std::uint8_t> doubtful = doubtful_elements(work, plan, reference.elements.size());
  for (std::size_t run = 0; run < plan.runs.size() && any(doubtful); ++run) {
    const EnsembleRun& planned = plan.ensemble.runs[run];
    if (!planned.own || !plan.runs[run].failure.empty()) continue;
    const auto reader = planned.own->open();
    const std::vector<Presence> all(reader->mesh().elements.size(), Presence::always);
    const std::vector<Presence> own = common_elements(reference, reader->mesh(), all, planned.name);
    for (std::size_t e = 0; e < doubtful.size(); ++e)
      if (own[e] == Presence::missing) doubtful[e] = 0;
  }
  return any(doubtful);
}

Ensemble from_own_files(Ensemble ensemble) {
  for (EnsembleRun& run : ensemble.runs)
    if (const auto own = run.own) run = *own;
  return ensemble;
}

}  // namespace lbea::bake
