#include "precompute/survey/surface_continuation.hpp"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>

namespace lbea::bake {
namespace {
using Eigen::Index;
using Displacements = Eigen::Matrix<double, Eigen::Dynamic, 3>;

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Calls visit(node, neighbor) for both ends of all sides of the elements.
template <class Visit>
void visit_sides(const SimulationMesh& mesh, const Visit& visit) {
  for (const Quad& element : mesh.elements)
    for (std::size_t i = 0; i < element.size(); ++i) {
      const std::uint32_t a = element[i], b = element[(i + 1) % element.size()];
      if (a == b) continue;  // triangles repeat a node
      visit(a, b);
      visit(b, a);
    }
}

/// Per node: 0 used by no element, 1 only by eroded ones, 2 by a living one.
std::vector<std::uint8_t> uses_of_nodes(const SimulationMesh& mesh, std::span<const std::uint8_t> alive) {
  std::vector<std::uint8_t> uses(mesh.nodes());
  for (std::size_t e = 0; e < mesh.elements.size(); ++e)
    for (const std::uint32_t node : mesh.elements[e])
      uses[node] = std::max<std::uint8_t>(uses[node], alive[e] != 0 ? 2 : 1);
  return uses;
}

/// Per node: the least of the nodes that sides of elements connect it with.
std::vector<std::uint32_t> representatives(const SimulationMesh& mesh) {
  std::vector<std::uint32_t> parents(mesh.nodes());
  std::iota(parents.begin(), parents.end(), 0u);
  const auto root = [&](std::uint32_t node) {
    while (parents[node] != node) node = parents[node] = parents[parents[node]];
    return node;
  };
  visit_sides(mesh, [&](std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parents[std::max(a, b)] = std::min(a, b);
  });
  for (std::uint32_t& node : parents) node = root(node);
  return parents;
}
}  // namespace

/// The free nodes for one set of living elements, and the factors of their graph Laplacian.
class SurfaceContinuation::Hole {
 public:
  Hole(const SimulationMesh& mesh, std::span<const std::uint8_t> alive)
      : mesh_(mesh), uses_(uses_of_nodes(mesh, alive)), number_(mesh.nodes(), none) {
    number_nodes();
    if (nodes_.empty()) return;
    std::vector<Eigen::Triplet<double>> entries;
    visit_sides(mesh, [&](std::uint32_t node, std::uint32_t neighbor) {
      if (number_[node] == none) return;
      const auto row = static_cast<Index>(number_[node]);
      entries.emplace_back(row, row, 1.0);
      if (number_[neighbor] == none)
        rim_.emplace_back(number_[node], neighbor);
      else
        entries.emplace_back(row, static_cast<Index>(number_[neighbor]), -1.0);
    });
    const auto size = std::ssize(nodes_);
    Eigen::SparseMatrix<double> laplacian(size, size);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    factor_.compute(laplacian);
  }

  void fill(std::vector<float>& positions) const {
    if (!nodes_.empty()) {
      Displacements sums = Displacements::Zero(std::ssize(nodes_), 3);
      for (const auto& [number, neighbor] : rim_) sums.row(number) += displacement(neighbor, positions);
      const Displacements found = factor_.solve(sums);
      for (Index i = 0; i < found.rows(); ++i) place(nodes_[static_cast<std::size_t>(i)], found.row(i), positions);
    }
    if (lost_.empty()) return;
    const Eigen::RowVector3d mean = mean_of_living(positions);
    for (const std::uint32_t node : lost_) place(node, mean, positions);
  }

 private:
  /// Free nodes with a connection to a living one are numbered; the others are lost.
  void number_nodes() {
    const std::vector<std::uint32_t> connected = representatives(mesh_);
    std::vector<std::uint8_t> lives(uses_.size());
    for (std::uint32_t node = 0; node < uses_.size(); ++node)
      if (uses_[node] == 2) lives[connected[node]] = 1;
    for (std::uint32_t node = 0; node < uses_.size(); ++node) {
      if (uses_[node] != 1) continue;
      if (lives[connected[node]] == 0) {
        lost_.push_back(node);
        continue;
      }
      number_[node] = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back(node);
    }
  }

  [[nodiscard]] Eigen::RowVector3d displacement(std::size_t node, const std::vector<float>& positions) const {
    Eigen::RowVector3d moved;
    for (std::size_t axis = 0; axis < 3; ++axis)
      moved[static_cast<Index>(axis)] = double{positions[3 * node + axis]} - double{mesh_.positions[3 * node + axis]};
    return moved;
  }
  [[nodiscard]] Eigen::RowVector3d mean_of_living(const std::vector<float>& positions) const {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double count = 0;
    for (std::size_t node = 0; node < uses_.size(); ++node)
      if (uses_[node] == 2) sum += displacement(node, positions), ++count;
    return count > 0 ? Eigen::RowVector3d(sum / count) : sum;
  }
  void place(std::size_t node, const Eigen::RowVector3d& moved, std::vector<float>& positions) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions[3 * node + axis] =
          static_cast<float>(double{mesh_.positions[3 * node + axis]} + moved[static_cast<Index>(axis)]);
  }

  const SimulationMesh& mesh_;
  std::vector<std::uint8_t> uses_;
  std::vector<std::uint32_t> number_;                         // per node of the mesh: its place in nodes_, or none
  std::vector<std::uint32_t> nodes_, lost_;                   // free ones
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rim_;  // free node's number, neighbor that lives
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

SurfaceContinuation::SurfaceContinuation(const SimulationMesh& mesh) : mesh_(mesh) {}

SurfaceContinuation::~SurfaceContinuation() = default;

void SurfaceContinuation::apply(SimulationState& state) {
  const bool fits = state.positions.size() == 3 * mesh_.nodes() && state.alive.size() == mesh_.elements.size();
  if (!fits || mesh_.is_continued || std::ranges::find(state.alive, 0) == state.alive.end()) return;
  if (state.alive != alive_) {
    hole_ = std::make_unique<const Hole>(mesh_, state.alive);
    alive_ = state.alive;
  }
  hole_->fill(state.positions);
}
}  // namespace lbea::bake
