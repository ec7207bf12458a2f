#include "precompute/survey/surface_continuation.hpp"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace lbea::bake {
namespace {
using Eigen::Index;
using Displacements = Eigen::Matrix<double, Eigen::Dynamic, 3>;

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Calls visit(node, neighbor) for both ends of all sides of the elements.
template <class Visit>
void visit_sides(const std::vector<Quad>& elements, const Visit& visit) {
  for (const Quad& element : elements)
    for (std::size_t i = 0; i < element.size(); ++i) {
      const std::uint32_t a = element[i], b = element[(i + 1) % element.size()];
      if (a == b) continue;  // triangles repeat a node
      visit(a, b);
      visit(b, a);
    }
}

/// Per node: the least of the nodes that sides of elements connect it with.
std::vector<std::uint32_t> representatives(const CommonMesh& mesh) {
  std::vector<std::uint32_t> parents(mesh.node_ids.size());
  std::iota(parents.begin(), parents.end(), 0u);
  const auto root = [&](std::uint32_t node) {
    while (parents[node] != node) node = parents[node] = parents[parents[node]];
    return node;
  };
  visit_sides(mesh.elements, [&](std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parents[std::max(a, b)] = std::min(a, b);
  });
  for (std::uint32_t& node : parents) node = root(node);
  return parents;
}

/// Positions of the nodes that the mesh has; not guessed ones.
std::unordered_map<std::uint32_t, const float*> known_places(const SimulationMesh& mesh) {
  std::unordered_map<std::uint32_t, const float*> places;
  for (std::size_t node = 0; node < mesh.nodes(); ++node)
    if (mesh.guessed.empty() || mesh.guessed[node] == 0) places.emplace(mesh.node_ids[node], &mesh.positions[3 * node]);
  return places;
}
}  // namespace

/// The free nodes of a common mesh, and the factors of their graph Laplacian.
class SurfaceContinuation::Hole {
 public:
  /// is_free: per node.
  Hole(const CommonMesh& mesh, std::vector<std::uint8_t> is_free)
      : is_free_(std::move(is_free)), number_(is_free_.size(), none) {
    number_nodes(mesh);
    if (nodes_.empty()) return;
    std::vector<Eigen::Triplet<double>> entries;
    visit_sides(mesh.elements, [&](std::uint32_t node, std::uint32_t neighbor) {
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

  [[nodiscard]] bool is_free(std::size_t node) const { return is_free_[node] != 0; }

  /// places, positions: N x 3. Continues their difference.
  void fill(const std::vector<float>& places, std::vector<float>& positions) const {
    if (!nodes_.empty()) {
      Displacements sums = Displacements::Zero(std::ssize(nodes_), 3);
      for (const auto& [number, neighbor] : rim_) sums.row(number) += displacement(neighbor, places, positions);
      const Displacements found = factor_.solve(sums);
      for (Index i = 0; i < found.rows(); ++i)
        place(nodes_[static_cast<std::size_t>(i)], found.row(i), places, positions);
    }
    if (lost_.empty()) return;
    const Eigen::RowVector3d mean = mean_of_living(places, positions);
    for (const std::uint32_t node : lost_) place(node, mean, places, positions);
  }

 private:
  /// Free nodes with a connection to a living one are numbered; the others are lost.
  void number_nodes(const CommonMesh& mesh) {
    const std::vector<std::uint32_t> connected = representatives(mesh);
    std::vector<std::uint8_t> lives(is_free_.size());
    for (std::uint32_t node = 0; node < is_free_.size(); ++node)
      if (!is_free(node)) lives[connected[node]] = 1;
    for (std::uint32_t node = 0; node < is_free_.size(); ++node) {
      if (!is_free(node)) continue;
      if (lives[connected[node]] == 0) {
        lost_.push_back(node);
        continue;
      }
      number_[node] = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back(node);
    }
  }

  static Eigen::RowVector3d displacement(std::size_t node, const std::vector<float>& places,
                                         const std::vector<float>& positions) {
    Eigen::RowVector3d moved;
    for (std::size_t axis = 0; axis < 3; ++axis)
      moved[static_cast<Index>(axis)] = double{positions[3 * node + axis]} - double{places[3 * node + axis]};
    return moved;
  }
  [[nodiscard]] Eigen::RowVector3d mean_of_living(const std::vector<float>& places,
                                                  const std::vector<float>& positions) const {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double count = 0;
    for (std::size_t node = 0; node < is_free_.size(); ++node)
      if (!is_free(node)) sum += displacement(node, places, positions), ++count;
    return count > 0 ? Eigen::RowVector3d(sum / count) : sum;
  }
  static void place(std::size_t node, const Eigen::RowVector3d& moved, const std::vector<float>& places,
                    std::vector<float>& positions) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions[3 * node + axis] =
          static_cast<float>(double{places[3 * node + axis]} + moved[static_cast<Index>(axis)]);
  }

  std::vector<std::uint8_t> is_free_;                         // per node of the common mesh
  std::vector<std::uint32_t> number_;                         // the same: its place in nodes_, or none
  std::vector<std::uint32_t> nodes_, lost_;                   // free ones
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rim_;  // free node's number, neighbor that lives
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

SurfaceContinuation::SurfaceContinuation(const SimulationMesh& mesh, const CommonMesh& common, MeshMapping mapping,
                                         const SimulationMesh* reference)
    : mesh_(mesh), common_(common), mapping_(std::move(mapping)), places_(of_common(mesh.positions)) {
  if (!mesh.guessed.empty()) find_places(reference);
}

SurfaceContinuation::~SurfaceContinuation() = default;

std::vector<float> SurfaceContinuation::of_common(const std::vector<float>& positions) const {
  std::vector<float> result;
  for (const std::uint32_t node : mapping_.nodes)
    for (std::size_t axis = 0; axis < 3; ++axis) result.push_back(positions[3 * std::size_t{node} + axis]);
  return result;
}

std::vector<std::uint8_t> SurfaceContinuation::of_common(const std::vector<std::uint8_t>& nodes) const {
  std::vector<std::uint8_t> result;
  for (const std::uint32_t node : mapping_.nodes) result.push_back(nodes[node]);
  return result;
}

// Places that neither run has continue coordinates; those that the reference run has, the difference of the runs.
void SurfaceContinuation::find_places(const SimulationMesh* reference) {
  const std::vector<std::uint8_t> guessed = of_common(mesh_.guessed);
  std::vector<std::uint8_t> is_unknown = guessed;
  std::vector<float> other = places_;
  if (reference != nullptr) {
    const auto known = known_places(*reference);
    for (std::size_t node = 0; node < guessed.size(); ++node)
      if (const auto found = known.find(common_.node_ids[node]); found != known.end()) {
        std::copy_n(found->second, 3, &other[3 * node]);
        is_unknown[node] = 0;
      }
  }
  Hole(common_, is_unknown).fill(std::vector<float>(places_.size()), other);
  Hole(common_, guessed).fill(other, places_);
}

void SurfaceContinuation::apply(SimulationState& state) {
  const bool fits = state.positions.size() == 3 * mesh_.nodes() && state.alive.size() == mesh_.elements.size();
  if (!fits || mesh_.is_continued || std::ranges::find(state.alive, 0) == state.alive.end()) return;
  if (state.alive != alive_) {
    hole_ = std::make_unique<const Hole>(common_, of_common(free_nodes(mesh_, state.alive)));
    alive_ = state.alive;
  }
  std::vector<float> positions = of_common(state.positions);
  hole_->fill(places_, positions);
  for (std::size_t node = 0; node < mapping_.nodes.size(); ++node)
    if (hole_->is_free(node))
      std::copy_n(&positions[3 * node], 3, &state.positions[3 * std::size_t{mapping_.nodes[node]}]);
}
}  // namespace lbea::bake
