#include "precompute/samples/sample_projection.hpp"

#include "runtime/src/match/correspondence.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea::bake {
namespace {

// Psi' M f, summed vertex by vertex: a library's product sums in an order that depends on the processor's caches, and
// the nodes of a cluster differ in them. Eight modes at a time stay in registers.
Eigen::MatrixXd product(const Eigen::MatrixXd& projection, const Eigen::MatrixXd& f) {
  constexpr Eigen::Index block = 8;
  Eigen::MatrixXd alpha = Eigen::MatrixXd::Zero(projection.rows(), 3);
  Eigen::Index first = 0;
  for (; first + block <= projection.rows(); first += block) {
    Eigen::Matrix<double, block, 3> sum = Eigen::Matrix<double, block, 3>::Zero();
    for (Eigen::Index v = 0; v < projection.cols(); ++v) {
      const Eigen::Matrix<double, block, 1> weights = projection.block<block, 1>(first, v);
      for (Eigen::Index axis = 0; axis < 3; ++axis) sum.col(axis) += weights * f(v, axis);
    }
    alpha.middleRows<block>(first) = sum;
  }
  for (Eigen::Index v = 0; v < projection.cols(); ++v)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      alpha.col(axis).tail(projection.rows() - first) += projection.col(v).tail(projection.rows() - first) * f(v, axis);
  return alpha;
}

CellGrid grid_around(const std::array<std::array<float, 3>, 2>& box, std::size_t nodes) {
  constexpr std::size_t most_cells = std::size_t{1} << 20;
  const std::size_t cells = std::clamp<std::size_t>(2 * nodes, 64, most_cells);  // folded sheets leave most cells empty
  return bounding_grid(box, static_cast<std::uint32_t>(cells));
}

}  // namespace

/// One run's way through, with its memory: one state.
class RunProjector {
 public:
  RunProjector(const SampleProjection& shared, const std::array<std::array<float, 3>, 2>& box)
      : shared_(shared),
        sample_(shared.plan_, shared.bases_),
        points_(sample_.positions.size() / 3),
        index_(grid_around(box, points_.size()), static_cast<std::uint32_t>(points_.size())),
        corresponding_(shared.bases_.front().vertex_nodes.size()),
        places_(shared.bases_.front().vertex_nodes.size()),
        moments_(shared.bases_.size()) {}

  void project(SimulationReader& reader, std::size_t run, WorkWriter& record, Stage& stage) {
    const BakePlan& plan = shared_.plan_;
    const std::string& name = plan.ensemble.runs[run].name;
    const RunSurvey& survey = plan.survey.runs[run];
    const MeshMapping mapping = map_common(plan.survey.mesh, reader.mesh(), name);
    for (const std::uint32_t step : survey.steps) {
      stage.check();
      reader.read(step, state_);
      check_state(reader, state_, name, step);
      take_positions(mapping);
      take_fields(mapping, survey);
      if (index_.build(points_, identity_transform).used != points_.size())
        throw Error(Status::bad_input, "run " + name + " changed while it was read; bake again");
      for (std::size_t reference = 0; reference < moments_.size(); ++reference) project(reference);
      write_sample(record, sample_);
      stage.step();
    }
    write_moments(record, moments_);
  }

 private:
  void take_positions(const MeshMapping& mapping) {
    for (std::size_t i = 0; i < mapping.nodes.size(); ++i) {
      const float* from = &state_.positions[3 * std::size_t{mapping.nodes[i]}];
      std::copy_n(from, 3, &sample_.positions[3 * i]);
      points_[i] = {from[0], from[1], from[2]};
    }
  }

  void take_fields(const MeshMapping& mapping, const RunSurvey& run) {
    for (std::size_t field = 0; field < run.fields.size(); ++field) {
      const std::vector<float>& from = state_.fields[run.fields[field]];
      for (std::size_t e = 0; e < mapping.elements.size(); ++e) sample_.fields[field][e] = from[mapping.elements[e]];
    }
  }

  // Step 3: the nearest node of the whole mesh for every vertex. Step 5: alpha = Psi' M f.
  void project(std::size_t part) {
    const ReferenceBasis& reference = shared_.bases_[part];
    correspond(index_, reference.vertex_positions, corresponding_, places_);
    if (!sample_.correspondence.empty()) sample_.correspondence[part] = places_;
    Eigen::MatrixXd f(reference.mass.size(), 3);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (Eigen::Index v = 0; v < f.rows(); ++v)
        f(v, axis) = double{corresponding_.planes[static_cast<std::size_t>(axis)][static_cast<std::size_t>(v)]};
    const Eigen::MatrixXd alpha = product(reference.projection, f);
    take_coefficients(part, alpha);
    moments_[part].add(reference.mass, f - shared_.reference_positions_[part],
                       alpha - shared_.reference_coefficients_[part]);
  }

  void take_coefficients(std::size_t part, const Eigen::MatrixXd& alpha) {
    std::vector<float>& planes = sample_.coefficients[part];  // their padding stays zero
    const std::size_t plane = planes.size() / 3;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t mode = 0; mode < static_cast<std::size_t>(alpha.rows()); ++mode)
        planes[axis * plane + mode] =
            static_cast<float>(alpha(static_cast<Eigen::Index>(mode), static_cast<Eigen::Index>(axis)));
  }

  const SampleProjection& shared_;
  SampleRecord sample_;
  SimulationState state_;
  std::vector<Point> points_;  // N, the sample's positions
  CloudIndex index_;
  Positions corresponding_;            // n
  std::vector<std::uint32_t> places_;  // n, nodes
  std::vector<Moments> moments_;       // per reference
};

SampleProjection::SampleProjection(const BakePlan& plan, const std::vector<ReferenceBasis>& bases)
    : plan_(plan), bases_(bases) {
  for (const ReferenceBasis& basis : bases) {
    Eigen::MatrixXd positions(basis.mass.size(), 3);
    for (Eigen::Index v = 0; v < positions.rows(); ++v)
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        positions(v, axis) =
            double{basis.vertex_positions[static_cast<std::size_t>(v)][static_cast<std::size_t>(axis)]};
    reference_coefficients_.push_back(product(basis.projection, positions));
    reference_positions_.push_back(std::move(positions));
  }
}

void SampleProjection::project_run(std::size_t run, SimulationReader& reader,
                                   const std::array<std::array<float, 3>, 2>& box, WorkWriter& record,
                                   Stage& stage) const {
  RunProjector(*this, box).project(reader, run, record, stage);
}

}  // namespace lbea::bake
