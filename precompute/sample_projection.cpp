#include "precompute/sample_projection.hpp"

#include "precompute/kept_variance.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/correspondence.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <limits>

namespace lbea {

namespace {

using format::SectionId;

/// What all threads share, read-only.
struct Plan {
  const ProjectionTask& task;
  CellGrid grid;                                        // holds every sample
  std::vector<std::uint64_t> first_sample;              // per run
  std::vector<Eigen::MatrixXd> reference_positions;     // per reference, n x 3
  std::vector<Eigen::MatrixXd> reference_coefficients;  // per reference, p x 3

  [[nodiscard]] std::size_t nodes() const { return task.survey.mesh.node_ids.size(); }
  [[nodiscard]] std::size_t vertices() const { return task.references.front().vertex_nodes.size(); }
  [[nodiscard]] std::size_t modes() const {
    return static_cast<std::size_t>(task.references.front().projection.rows());
  }
};

Plan make_plan(const ProjectionTask& task) {
  Plan plan{task, {}, {}, {}, {}};
  constexpr std::size_t most_cells = std::size_t{1} << 20;
  const std::size_t cells =
      std::clamp<std::size_t>(2 * plan.nodes(), 64, most_cells);  // folded sheets leave most cells empty
  plan.grid = bounding_grid(std::array{task.survey.min, task.survey.max}, static_cast<std::uint32_t>(cells));
  std::uint64_t samples = 0;
  for (const RunSurvey& run : task.survey.runs) {
    plan.first_sample.push_back(samples);
    samples += run.steps.size();
  }
  for (const ReferenceBasis& reference : task.references) {
    Eigen::MatrixXd positions(reference.mass.size(), 3);
    for (Eigen::Index v = 0; v < positions.rows(); ++v)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        positions(v, axis) =
            double{reference.vertex_positions[static_cast<std::size_t>(v)][static_cast<std::size_t>(axis)]};
    plan.reference_coefficients.push_back(reference.projection * positions);
    plan.reference_positions.push_back(std::move(positions));
  }
  return plan;
}

/// One thread's share of the work, with its memory: one state.
class Projector {
 public:
  Projector(const Plan& plan, ModelWriter& writer, EnvelopeBuilder& envelope)
      : plan_(plan), writer_(writer), envelope_(envelope),
        index_(plan.grid, static_cast<std::uint32_t>(plan.nodes())), positions_(3 * plan.nodes()),
        points_(plan.nodes()), field_(plan.task.survey.mesh.elements.size()), corresponding_(plan.vertices()),
        places_(plan.vertices()), planes_(3 * format::padded(plan.modes())) {}

  std::vector<Moments> project_run(std::size_t run, Stage& stage) {
    const Survey& survey = plan_.task.survey;
    const EnsembleRun& ensemble_run = plan_.task.ensemble.runs[run];
    const auto reader = ensemble_run.open();
    const MeshMapping mapping = map_common(survey.mesh, reader->mesh(), ensemble_run.name);
    std::vector<Moments> moments(plan_.task.references.size());
    std::uint64_t sample = plan_.first_sample[run];
    for (const std::uint32_t step : survey.runs[run].steps) {
      stage.check();
      reader->read(step, state_);
      check_state(*reader, state_, ensemble_run.name, step);
      take_positions(mapping, sample);
      take_fields(mapping, survey.runs[run], sample);
      envelope_.add(positions_, survey.mesh.elements);
      if (index_.build(points_, identity_transform).used != points_.size())
        throw Error(Status::bad_input, "run " + ensemble_run.name + " changed while it was read; bake again");
      for (std::uint32_t reference = 0; reference < moments.size(); ++reference)
        project(reference, sample, moments[reference]);
      if (plan_.task.views != nullptr) plan_.task.views->render(sample, positions_);
      ++sample;
      stage.step();
    }
    return moments;
  }

  /// Of the state read last: some hundred nodes, x 3.
  [[nodiscard]] std::vector<float> landmarks() const {
    constexpr std::size_t most = 512;
    std::vector<float> chosen;
    const std::size_t every = (points_.size() + most - 1) / most;
    for (std::size_t i = 0; i < points_.size(); i += every) chosen.insert(chosen.end(), {points_[i].x, points_[i].y, points_[i].z});
    return chosen;
  }

 private:
  void take_positions(const MeshMapping& mapping, std::uint64_t sample) {
    for (std::size_t i = 0; i < mapping.nodes.size(); ++i) {
      const float* from = &state_.positions[3 * std::size_t{mapping.nodes[i]}];
      std::copy_n(from, 3, &positions_[3 * i]);
      points_[i] = {from[0], from[1], from[2]};
    }
    writer_.write<float>(SectionId::node_positions, 0, sample * positions_.size(), positions_);
  }

  void take_fields(const MeshMapping& mapping, const RunSurvey& run, std::uint64_t sample) {
    for (std::uint32_t field = 0; field < run.fields.size(); ++field) {
      const std::vector<float>& from = state_.fields[run.fields[field]];
      for (std::size_t e = 0; e < field_.size(); ++e) field_[e] = from[mapping.elements[e]];
      writer_.write<float>(SectionId::field_values, field, sample * field_.size(), field_);
    }
  }

  // Step 3: the nearest node of the whole mesh for every vertex. Step 5: alpha = Psi' M f.
  void project(std::uint32_t part, std::uint64_t sample, Moments& moments) {
    const ReferenceBasis& reference = plan_.task.references[part];
    correspond(index_, reference.vertex_positions, corresponding_, places_);
    if (plan_.task.with_correspondence)
      writer_.write<std::uint32_t>(SectionId::correspondence, part, sample * places_.size(), places_);
    Eigen::MatrixXd f(reference.mass.size(), 3);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (Eigen::Index v = 0; v < f.rows(); ++v)
        f(v, axis) =
            double{corresponding_.planes[static_cast<std::size_t>(axis)][static_cast<std::size_t>(v)]};
    const Eigen::MatrixXd alpha = reference.projection * f;
    write_coefficients(part, sample, alpha);
    moments.add(reference.mass, f - plan_.reference_positions[part],
                alpha - plan_.reference_coefficients[part]);
  }

  void write_coefficients(std::uint32_t part, std::uint64_t sample, const Eigen::MatrixXd& alpha) {
    const std::size_t plane = planes_.size() / 3;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t mode = 0; mode < plan_.modes(); ++mode)
        planes_[axis * plane + mode] =
            static_cast<float>(alpha(static_cast<Eigen::Index>(mode), static_cast<Eigen::Index>(axis)));
    writer_.write<float>(SectionId::coefficients, part, sample * planes_.size(), planes_);
  }

  const Plan& plan_;
  ModelWriter& writer_;
  EnvelopeBuilder& envelope_;
  CloudIndex index_;
  SimulationState state_;
  std::vector<float> positions_;       // N x 3
  std::vector<Point> points_;          // N, the same
  std::vector<float> field_;           // E
  Positions corresponding_;            // n
  std::vector<std::uint32_t> places_;  // n, nodes
  std::vector<float> planes_;          // 3 x padded p, padding stays zero
};

double kept_share(const std::vector<ReferenceBasis>& references, const std::vector<Moments>& moments) {
  double kept = 0, total = 0;
  for (std::size_t reference = 0; reference < references.size(); ++reference) {
    kept += moments[reference].kept();
    total += moments[reference].total(references[reference].mass);
  }
  return total > 0 ? kept / total : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

ProjectedSamples project_samples(const ProjectionTask& task, ModelWriter& writer, EnvelopeBuilder& envelope,
                       unsigned threads, Stage& stage) {
  const Plan plan = make_plan(task);
  MomentsInOrder moments(task.references.size());
  const std::size_t runs = task.ensemble.runs.size();
  ProjectedSamples projected;
  projected.last_states.resize(runs);
  work_in_parallel(runs, threads, [&](const auto& next) {
    Projector projector(plan, writer, envelope);
    for (std::size_t run = next(); run < runs; run = next()) {
      moments.add(run, projector.project_run(run, stage));
      projected.last_states[run] = projector.landmarks();
    }
  });
  projected.kept_variance = kept_share(task.references, moments.sum());
  for (const Moments& of_reference : moments.sum()) projected.leading_axes.push_back(of_reference.leading_axes());
  return projected;
}

}  // namespace lbea
