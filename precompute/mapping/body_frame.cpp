#include "precompute/mapping/body_frame.hpp"

#include "precompute/survey/common_mesh.hpp"

#include <Eigen/Dense>

#include <map>
#include <numbers>

namespace lbea::bake {
namespace {

constexpr std::array<std::string_view, 4> history_names{"rigid_x", "rigid_y", "rigid_z", "rigid_turn"};

Eigen::Vector3d place(const std::vector<float>& positions, std::size_t node) {
  return Eigen::Map<const Eigen::Vector3f>(&positions[3 * node]).cast<double>();
}

/// A share of the area of each node's elements, length unit squared.
std::vector<double> node_areas(const SimulationMesh& mesh) {
  std::vector<double> areas(mesh.nodes());
  for (std::size_t e = 0; e + mesh.touching < mesh.elements.size(); ++e) {
    const auto& [a, b, c, d] = mesh.elements[e];
    const Eigen::Vector3d diagonal = place(mesh.positions, c) - place(mesh.positions, a),
                          other = place(mesh.positions, d) - place(mesh.positions, b);
    const double area = diagonal.cross(other).norm() / 2;
    for (const std::uint32_t node : mesh.elements[e]) areas[node] += area / 4;
  }
  return areas;
}

constexpr double least_extent = 0.02;  // of the nodes, across to along: else they do not tell how the body rolls

/// x of the body frame = rotation x of the state + shift.
struct RigidMotion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d shift;
};

}  // namespace

/// The nodes of the frame in the undeformed reference run.
struct BodyFrameShape {
  struct Node {
    std::uint32_t id;
    Eigen::Vector3d place;
    double weight;
  };
  SimulationMesh mesh;
  std::vector<Node> nodes;
  Eigen::Vector3d center;

  BodyFrameShape(SimulationMesh reference, const BodyFrameNodes& chosen) : mesh(std::move(reference)) {
    chosen.ids.empty() ? take_all() : take(chosen.ids);
    center.setZero();
    double weights = 0;
    for (const Node& node : nodes) center += node.weight * node.place, weights += node.weight;
    center /= weights;
    require_three_directions();
  }

 private:
  void take_all() {
    const std::vector<double> areas = node_areas(mesh);
    for (std::size_t n = 0; n < mesh.nodes(); ++n)
      if (areas[n] > 0 && (mesh.guessed.empty() || mesh.guessed[n] == 0))
        nodes.push_back({mesh.node_ids[n], bake::place(mesh.positions, n), areas[n]});
    if (nodes.empty()) throw Error(Status::bad_config, "rigid: the reference run's elements have no area");
  }
  void take(const std::vector<std::uint32_t>& ids) {
    for (const std::uint32_t id : ids) {
      const std::string node = "node " + std::to_string(id);
      const auto found = std::ranges::find(mesh.node_ids, id);
      if (found == mesh.node_ids.end()) throw Error(Status::bad_config, "rigid: the reference run has no " + node);
      if (std::ranges::count(ids, id) > 1) throw Error(Status::bad_config, "rigid: " + node + " is named twice");
      const auto n = static_cast<std::size_t>(found - mesh.node_ids.begin());
      if (!mesh.guessed.empty() && mesh.guessed[n] != 0)
        throw Error(Status::bad_config, "rigid: the reference run has no undeformed position of " + node);
      nodes.push_back({id, bake::place(mesh.positions, n), 1});
    }
  }
  void require_three_directions() const {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Node& node : nodes) squares += node.weight * (node.place - center) * (node.place - center).transpose();
    const Eigen::Vector3d extents = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvalues();
    if (!(extents[1] > least_extent * least_extent * extents[2]))
      throw Error(Status::bad_config, "rigid: the nodes lie on a line; name three that do not");
  }
};

namespace {

class BodyFixedRun final : public DerivedRun {
 public:
  BodyFixedRun(std::unique_ptr<SimulationReader> run, std::shared_ptr<const BodyFrameShape> reference, bool may_lack,
               std::string name)
      : DerivedRun(std::move(run)), reference_(std::move(reference)), may_lack_(may_lack), name_(std::move(name)) {
    std::map<std::uint32_t, std::size_t> nodes;
    for (std::size_t n = 0; n < mesh().nodes(); ++n) nodes.emplace(mesh().node_ids[n], n);
    for (const auto& node : reference_->nodes) {
      const auto found = nodes.find(node.id);
      if (found == nodes.end() && !may_lack_)
        throw Error(Status::bad_config, "rigid: run " + name_ + " has no node " + std::to_string(node.id));
      nodes_.push_back(found == nodes.end() ? none : found->second);
    }
    for (const SimulationHistory& history : run_->histories()) of_run_ += static_cast<std::uint32_t>(history.size());
  }

  std::vector<SimulationHistory> histories() override {
    std::vector<SimulationHistory> all = run_->histories();
    for (const std::string_view name : history_names) all.push_back({std::string(name)});
    return all;
  }
  HistorySeries history_series(std::uint32_t place) override {
    return place < of_run_ ? run_->history_series(place) : HistorySeries{};
  }
  double history(std::uint32_t state, std::uint32_t place) override {
    if (place < of_run_) return run_->history(state, place);
    if (!removed_.contains(state)) read(state, state_);
    return removed_.at(state)[place - of_run_];
  }

  void read(std::uint32_t state, SimulationState& into) override {
    run_->read(state, into);
    if (into.positions.size() != 3 * mesh().nodes()) return;  // refused by check_state()
    const RigidMotion motion = motion_of(into, state);
    for (std::size_t n = 0; n < mesh().nodes(); ++n)
      Eigen::Map<Eigen::Vector3f>(&into.positions[3 * n]) =
          (motion.rotation * place(into.positions, n) + motion.shift).cast<float>();
  }

 private:
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

  /// Kabsch 1976. Also sets removed_.
  RigidMotion motion_of(const SimulationState& state, std::uint32_t step) {
    const std::vector<std::uint8_t> is_free = free_nodes(mesh(), state.alive);
    const auto visit = [&](const auto& use) {
      for (std::size_t i = 0; i < nodes_.size(); ++i)
        if (nodes_[i] != none && is_used(nodes_[i], is_free, step))
          use(reference_->nodes[i], place(state.positions, nodes_[i]));
    };
    double weights = 0;
    Eigen::Vector3d here = Eigen::Vector3d::Zero(), there = Eigen::Vector3d::Zero();
    visit([&](const auto& node, const Eigen::Vector3d& position) {
      weights += node.weight, here += node.weight * position, there += node.weight * node.place;
    });
    if (!(weights > 0))
      throw Error(Status::bad_input,
                  "rigid: run " + name_ + " has no node of the reference run in state " + std::to_string(step));
    here /= weights, there /= weights;
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    visit([&](const auto& node, const Eigen::Vector3d& position) {
      products += node.weight * (node.place - there) * (position - here).transpose();
    });
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (!(svd.singularValues()[1] > least_extent * least_extent * svd.singularValues()[0]))
      throw Error(Status::bad_input, "rigid: the nodes lie on a line in state " + std::to_string(step) + " of run " +
                                         name_ + "; name others");
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d rotation =
        svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    const RigidMotion motion{rotation, there - rotation * here};
    const Eigen::Vector3d moved = rotation.transpose() * (reference_->center - motion.shift) - reference_->center;
    removed_[step] = {moved.x(), moved.y(), moved.z(), Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi};
    return motion;
  }
  [[nodiscard]] bool is_used(std::size_t node, const std::vector<std::uint8_t>& is_free, std::uint32_t step) const {
    if (is_free[node] == 0) return true;
    if (may_lack_) return false;
    throw Error(Status::bad_input, "rigid: all elements of node " + std::to_string(mesh().node_ids[node]) +
                                       " have eroded in state " + std::to_string(step) + " of run " + name_ +
                                       "; name another node");
  }

  std::shared_ptr<const BodyFrameShape> reference_;
  bool may_lack_;  // nodes: they were not named
  std::string name_;
  std::vector<std::size_t> nodes_;  // per node of the reference shape; none: the run lacks it
  std::uint32_t of_run_ = 0;        // numbers of the run's own histories
  std::map<std::uint32_t, std::array<double, history_names.size()>> removed_;  // by state
  SimulationState state_;
};

}  // namespace

std::unique_ptr<SimulationReader> BodyFrame::fixed(std::unique_ptr<SimulationReader> reader, const std::string& run) {
  auto shape = reference();
  if (!has_numbers_of(shape->mesh, reader->mesh()))
    throw Error(Status::bad_input, "rigid: run " + run + " does not have the reference run's node and element ids");
  return std::make_unique<BodyFixedRun>(std::move(reader), std::move(shape), nodes_.ids.empty(), run);
}

std::shared_ptr<const BodyFrameShape> BodyFrame::reference() {
  const std::lock_guard lock(mutex_);
  if (!reference_) reference_ = std::make_shared<const BodyFrameShape>(open_reference_()->mesh(), nodes_);
  return reference_;
}

bool is_rigid_motion(std::string_view history) {
  return std::ranges::find(history_names, history) != history_names.end();
}

EnsembleDescription with_rigid_motion(EnsembleDescription description) {
  if (!description.rigid.are_set) return description;
  for (const std::string_view name : history_names) {
    ChannelDescription& channel = description.channels.emplace_back();
    channel.name = channel.history.name = name;
    channel.kind = ChannelKind::history;
    channel.unit = name == history_names.back() ? "deg" : description.length_unit;
  }
  return description;
}

}  // namespace lbea::bake
