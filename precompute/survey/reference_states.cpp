#include "precompute/survey/reference_states.hpp"

#include "precompute/parallel.hpp"
#include "precompute/stage.hpp"
#include "precompute/survey/observed_region.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea::bake {
namespace {

/// The reference run at one of its states, on the common mesh.
struct ReferenceState {
  double time_s = 0;             // since impact
  std::vector<float> positions;  // N x 3
};

/// Reads states of the reference run.
class ReferenceRun {
 public:
  ReferenceRun(const Ensemble& ensemble, const EnsembleDescription& description, const CommonMesh& mesh)
      : name_(ensemble.runs[ensemble.reference_run].name),
        reader_(ensemble.runs[ensemble.reference_run].open()),
        mapping_(map_common(mesh, reader_->mesh(), name_)),
        time_factor_(description.time_factor) {
    if (description.impact_step >= reader_->states())
      throw Error(Status::bad_config, "the impact is at state " + std::to_string(description.impact_step) +
                                          ", but run " + name_ + " has " + std::to_string(reader_->states()) +
                                          " states");
    impact_time_ = reader_->time_s(description.impact_step);
  }

  ReferenceState at(std::uint32_t step) {
    reader_->read(step, state_);
    check_state(*reader_, state_, name_, step);
    ReferenceState reference{(reader_->time_s(step) - impact_time_) * time_factor_, {}};
    for (const std::uint32_t node : mapping_.nodes) {
      const float* p = &state_.positions[3 * std::size_t{node}];
      reference.positions.insert(reference.positions.end(), p, p + 3);
    }
    return reference;
  }

 private:
  const std::string& name_;
  std::unique_ptr<SimulationReader> reader_;
  MeshMapping mapping_;
  double time_factor_;
  double impact_time_ = 0;
  SimulationState state_;
};

ObservedRegion choose_region(const RegionDescription& region, const BakeOptions& options, const Survey& survey,
                             const ReferenceState& impact) {
  RegionCriteria criteria{region.parts, region.box, region.node_ids, {}};
  if (options.visible_nodes) criteria.visible = options.visible_nodes(survey.mesh, impact.positions);
  return observed_region(survey.mesh, impact.positions, criteria, survey.reference_node_ids);
}

/// (a) at impact: one mesh; (b) over time: the reference run at each of its used states.
std::vector<ReferenceState> reference_states(ReferenceMode mode, ReferenceRun& run, const ReferenceState& impact,
                                             const std::vector<std::uint32_t>& steps) {
  if (mode == ReferenceMode::impact) return {impact};
  std::vector<ReferenceState> states;
  for (const std::uint32_t step : steps) states.push_back(run.at(step));
  if (!std::ranges::is_sorted(states, {}, &ReferenceState::time_s))
    throw Error(Status::bad_input, "the times of the reference run do not ascend");
  return states;
}

}  // namespace

std::vector<std::uint64_t> make_bases(const WorkFolder& work, const Ensemble& ensemble,
                                      const EnsembleDescription& description, const Survey& survey,
                                      const BakeOptions& options) {
  ReferenceRun run(ensemble, description, survey.mesh);
  const ReferenceState impact = run.at(description.impact_step);
  const ObservedRegion region = choose_region(description.region, options, survey, impact);
  const auto states = reference_states(description.mode, run, impact, survey.runs[ensemble.reference_run].steps);
  Stage stage(options, "bases", states.size());
  std::vector<std::uint64_t> keys(states.size());
  work_in_parallel(states.size(), options.threads, [&](const auto& next) {
    for (std::size_t i = next(); i < states.size(); i = next()) {
      stage.check();
      keys[i] = basis_key(region, survey.mesh, states[i].positions, description.modes, states[i].time_s);
      if (!work.has({WorkKind::basis, keys[i]}))
        write_basis(
            work, keys[i],
            reference_basis(region, states[i].positions, survey.mesh.node_ids, description.modes, states[i].time_s));
      stage.step();
    }
  });
  return keys;
}

}  // namespace lbea::bake
