#include "precompute/bake.hpp"

#include "precompute/branches.hpp"
#include "precompute/envelope.hpp"
#include "precompute/model_sections.hpp"
#include "precompute/observed_region.hpp"
#include "precompute/parallel.hpp"
#include "precompute/provenance.hpp"
#include "precompute/reference_basis.hpp"
#include "precompute/sample_projection.hpp"
#include "precompute/sample_views.hpp"
#include "precompute/stage.hpp"
#include "precompute/survey.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <set>
#include <utility>

namespace lbea {

namespace {

using format::SectionId;

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(begin_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// The reference run at one of its states, on the common mesh.
struct ReferenceState {
  double time_s = 0;             // since impact
  std::vector<float> positions;  // N x 3
};

void check(const Ensemble& ensemble, const EnsembleDescription& description) {
  if (ensemble.runs.empty()) throw Error(Status::bad_config, "the ensemble has no runs; name at least one");
  if (ensemble.reference_run >= ensemble.runs.size())
    throw Error(Status::bad_config, "the reference run is not one of the ensemble's");
  if (!(description.time_factor > 0 && description.time_factor < std::numeric_limits<double>::infinity()))
    throw Error(Status::bad_config,
                "the time factor must be positive, it is " + std::to_string(description.time_factor));
  std::set<std::string> names;
  for (const EnsembleRun& run : ensemble.runs) {
    if (!names.insert(run.name).second)
      throw Error(Status::bad_config,
                  "two runs are called '" + run.name + "'; results could not tell them apart, rename one");
    if (run.parameters.size() != ensemble.parameter_names.size())
      throw Error(Status::bad_config, "run " + run.name + " has " + std::to_string(run.parameters.size()) +
                                          " parameters, not " +
                                          std::to_string(ensemble.parameter_names.size()));
  }
}

/// Reads states of the reference run.
class ReferenceRun {
 public:
  ReferenceRun(const Ensemble& ensemble, const EnsembleDescription& description, const CommonMesh& mesh)
      : name_(ensemble.runs[ensemble.reference_run].name),
        reader_(ensemble.runs[ensemble.reference_run].open()),
        mapping_(map_common(mesh, reader_->mesh(), name_)), time_factor_(description.time_factor) {
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

ObservedRegion choose_region(const RegionDescription& region, const BakeOptions& options,
                             const Survey& survey, const ReferenceState& impact) {
  RegionCriteria criteria{region.parts, region.box, region.node_ids, {}};
  if (options.visible_nodes) criteria.visible = options.visible_nodes(survey.mesh, impact.positions);
  return observed_region(survey.mesh, impact.positions, criteria, survey.reference_node_ids);
}

/// (a) at impact: one mesh; (b) over time: the reference run at each of its used states.
std::vector<ReferenceState> reference_states(ReferenceMode mode, ReferenceRun& run,
                                             const ReferenceState& impact,
                                             const std::vector<std::uint32_t>& steps) {
  if (mode == ReferenceMode::impact) return {impact};
  std::vector<ReferenceState> states;
  for (const std::uint32_t step : steps) states.push_back(run.at(step));
  if (!std::ranges::is_sorted(states, {}, &ReferenceState::time_s))
    throw Error(Status::bad_input, "the times of the reference run do not ascend");
  return states;
}

std::vector<ReferenceBasis> reference_bases(const ObservedRegion& region,
                                            const std::vector<ReferenceState>& states,
                                            std::span<const std::uint32_t> node_ids, std::uint32_t p,
                                            const BakeOptions& options) {
  Stage stage(options, "bases", states.size());
  std::vector<ReferenceBasis> bases(states.size());
  work_in_parallel(states.size(), options.threads, [&](const auto& next) {
    for (std::size_t i = next(); i < states.size(); i = next()) {
      stage.check();
      bases[i] = reference_basis(region, states[i].positions, node_ids, p, states[i].time_s);
      stage.step();
    }
  });
  return bases;
}

std::vector<Sample> samples_of(const Survey& survey) {
  std::vector<Sample> samples;
  for (std::uint32_t run = 0; run < survey.runs.size(); ++run)
    for (const std::uint32_t step : survey.runs[run].steps) samples.push_back({run, step});
  return samples;
}

BakeSummary summarise(const format::Info& info, const std::vector<ReferenceBasis>& bases) {
  BakeSummary summary;
  summary.vertices = info.vertices;
  summary.modes = info.modes;
  summary.samples = info.samples;
  summary.simulations = info.simulations;
  summary.references = info.references;
  summary.nodes = info.nodes;
  summary.elements = info.elements;
  summary.fields = info.fields;
  summary.parameters = info.parameters;
  const auto worst = std::ranges::max_element(bases, {}, &ReferenceBasis::residual);
  summary.basis_residual = worst->residual;
  summary.basis_solver = worst->solver;
  for (const ReferenceBasis& basis : bases) summary.degenerate_triangles += basis.degenerate_triangles;
  summary.highest_eigenvalue = bases.front().eigenvalues[bases.front().eigenvalues.size() - 1];
  return summary;
}

}  // namespace

BakeSummary bake(const Ensemble& ensemble, const EnsembleDescription& description,
                 const std::filesystem::path& output, const BakeOptions& options) {
  Stopwatch watch;
  BakeSummary::Seconds seconds;
  check(ensemble, description);

  // Step 2: what all samples have in common, the reference mesh and the part of it that is observed.
  Stage reading(options, "reading", ensemble.runs.size());
  const Survey survey = survey_runs(ensemble, description, options.threads, reading);
  ReferenceRun reference_run(ensemble, description, survey.mesh);
  const ReferenceState impact = reference_run.at(description.impact_step);
  const ObservedRegion region = choose_region(description.region, options, survey, impact);
  const auto states =
      reference_states(description.mode, reference_run, impact, survey.runs[ensemble.reference_run].steps);
  seconds.reading = watch.lap();

  // Step 5: L psi = lambda M psi on every reference mesh, and the tree over its vertices.
  const std::vector<ReferenceBasis> bases =
      reference_bases(region, states, survey.mesh.node_ids, description.modes, options);
  seconds.bases = watch.lap();

  // Steps 3 and 5: every sample's nearest nodes and alpha = Psi' M f, written as they come.
  EnvelopeBuilder envelope(survey.min, survey.max, description.envelope_margin);
  const format::Info info = model_info(description, ensemble, survey, bases, envelope.layout());
  const SmallSections small = small_sections(info, description, ensemble, survey, bases, envelope.layout());
  const std::size_t provenance_size = provenance_json(description, ensemble, survey, bases, 0).size() + 32;
  std::vector<PlannedSection> plan;
  small.plan(plan);
  const auto renderer = options.views ? options.views(survey.mesh, survey.min, survey.max) : nullptr;
  std::optional<SampleViews> views;
  if (renderer) views.emplace(*renderer, info.samples);
  plan_large_sections(plan, info, description.correspondence, provenance_size, views ? &*views : nullptr);
  ModelWriter writer(output, std::move(plan));
  small.write(writer);
  Stage projecting(options, "samples", info.samples);
  const ProjectionTask task{ensemble, survey, bases, description.correspondence, views ? &*views : nullptr};
  const ProjectedSamples projected = project_samples(task, writer, envelope, options.threads, projecting);
  const double kept = projected.kept_variance;
  seconds.samples = watch.lap();

  // What was learned on the way: the view's axes, the branches, how well simulations explain one another.
  for (std::uint32_t part = 0; part < info.references; ++part)
    writer.write<std::uint32_t>(SectionId::leading_axes, part, 0, projected.leading_axes[part]);
  writer.write<std::uint32_t>(SectionId::simulation_branches, 0, 0, deformation_branches(projected.last_states));
  if (views) {
    views->calibrate(samples_of(survey), options.threads);
    write_views(writer, *views);
  }
  writer.write<std::uint64_t>(SectionId::envelope_bits, 0, 0, envelope.finish().bits);
  std::string provenance = provenance_json(description, ensemble, survey, bases, kept);
  provenance.resize(provenance_size, ' ');  // its length was planned before its content was known
  writer.write<char>(SectionId::provenance, 0, 0, provenance);
  writer.commit();
  seconds.writing = watch.lap();

  BakeSummary summary = summarise(info, bases);
  summary.file_size = writer.file_size();
  summary.kept_variance = kept;
  summary.seconds = seconds;
  return summary;
}

}  // namespace lbea
