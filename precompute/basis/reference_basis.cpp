#include "precompute/basis/reference_basis.hpp"

#include "precompute/parallel.hpp"
#include "precompute/work/bake_plan.hpp"

#include <numeric>

namespace lbea::bake {
namespace {

// Vertices. Of a larger region, more modes than vertices are refused as a mistake.
constexpr std::size_t small_region = 300;

std::vector<float> region_positions(const ObservedRegion& region, std::span<const float> positions) {
  std::vector<float> chosen;
  chosen.reserve(3 * region.nodes.size());
  for (const std::uint32_t node : region.nodes)
    chosen.insert(chosen.end(), &positions[3 * std::size_t{node}], &positions[3 * std::size_t{node}] + 3);
  return chosen;
}

void check_mass(const Eigen::VectorXd& mass, const ObservedRegion& region, std::span<const std::uint32_t> node_ids,
                double time_s) {
  for (Eigen::Index i = 0; i < mass.size(); ++i)
    if (!(mass[i] > 0))
      throw Error(Status::bad_input, "the elements around node " +
                                         std::to_string(node_ids[region.nodes[static_cast<std::size_t>(i)]]) +
                                         " have no area in the reference mesh " + std::to_string(time_s) +
                                         " s after the impact; leave the node out of the region");
}

class Builder {
 public:
  Builder(std::span<const float> positions, BakedTree& tree) : positions_(positions), tree_(tree) {}

  void build(std::uint32_t first, std::uint32_t count) {
    const std::size_t node = tree_.ranges.size();
    tree_.boxes.push_back(box_of(first, count));
    tree_.ranges.push_back({first, count, 0});
    const auto begin = tree_.order.begin() + first, end = begin + count;
    if (count <= vertex_tree_leaf) {
      std::sort(begin, end);
      return;
    }
    const std::uint32_t left = count / 2;
    const std::size_t axis = longest_side(tree_.boxes[node]);
    std::nth_element(begin, begin + left, end, [&](std::uint32_t a, std::uint32_t b) {
      const float at_a = positions_[3 * std::size_t{a} + axis], at_b = positions_[3 * std::size_t{b} + axis];
      return at_a != at_b ? at_a < at_b : a < b;
    });
    build(first, left);
    tree_.ranges[node][2] = static_cast<std::uint32_t>(tree_.ranges.size());
    build(first + left, count - left);
  }

 private:
  [[nodiscard]] std::array<float, 6> box_of(std::uint32_t first, std::uint32_t count) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, 6> box{infinity, infinity, infinity, -infinity, -infinity, -infinity};
    for (std::uint32_t i = first; i < first + count; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float x = positions_[3 * std::size_t{tree_.order[i]} + axis];
        box[axis] = std::min(box[axis], x);
        box[axis + 3] = std::max(box[axis + 3], x);
      }
    return box;
  }

  static std::size_t longest_side(const std::array<float, 6>& box) {
    const std::array<float, 3> sides{box[3] - box[0], box[4] - box[1], box[5] - box[2]};
    return static_cast<std::size_t>(std::max_element(sides.begin(), sides.end()) - sides.begin());
  }

  std::span<const float> positions_;
  BakedTree& tree_;
};

}  // namespace

ReferenceBasis reference_basis(const ObservedRegion& region, std::span<const float> positions,
                               std::span<const std::uint32_t> node_ids, std::uint32_t p, double time_s) {
  const std::vector<float> at = region_positions(region, positions);
  const MeshLaplacian laplacian = mesh_laplacian(at, region.elements);
  check_mass(laplacian.mass, region, node_ids, time_s);
  const Eigenbasis basis = eigenbasis(laplacian, p);

  ReferenceBasis reference;
  reference.time_s = time_s;
  reference.tree = build_vertex_tree(at);
  const auto n = static_cast<Eigen::Index>(region.nodes.size());
  reference.mass.resize(n);
  reference.projection.resize(p, n);
  for (Eigen::Index vertex = 0; vertex < n; ++vertex) {
    const std::uint32_t i = reference.tree.order[static_cast<std::size_t>(vertex)];
    reference.vertex_nodes.push_back(region.nodes[i]);
    reference.vertex_positions.push_back(
        {at[3 * std::size_t{i}], at[3 * std::size_t{i} + 1], at[3 * std::size_t{i} + 2]});
    reference.mass[vertex] = laplacian.mass[i];
    reference.projection.col(vertex) = basis.modes.row(i).transpose() * laplacian.mass[i];
  }
  reference.eigenvalues = basis.eigenvalues;
  reference.residual = basis.residual;
  reference.solver = basis.solver;
  reference.degenerate_triangles = laplacian.degenerate_triangles;
  return reference;
}

void solve_bases(const WorkFolder& work, BakePlan& plan, const Reference& reference, const BakeOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  if (reference.region.without_area > 0)
    plan.survey.warnings.push_back(std::to_string(reference.region.without_area) +
                                   " elements of the region have no area and were skipped");
  const std::size_t vertices = reference.region.nodes.size();
  if (plan.description.modes > vertices && vertices <= small_region) {
    plan.survey.warnings.push_back(std::to_string(plan.description.modes) + " modes were asked of a region with " +
                                   std::to_string(vertices) + " vertices; it has no more than these");
    plan.description.modes = static_cast<std::uint32_t>(vertices);
  }
  const std::uint32_t modes = plan.description.modes;
  const CommonMesh& mesh = plan.survey.mesh;
  plan.bases.resize(reference.states.size());
  Stage stage(options, "bases", reference.states.size());
  work_in_parallel(reference.states.size(), options.workers(), [&](const auto& next) {
    for (std::size_t i = next(); i < reference.states.size(); i = next()) {
      stage.check();
      const double time_s = reference.states[i].time_s;
      const std::vector<float>& positions = reference.states[i].positions;
      plan.bases[i] = basis_key(reference.region, mesh, positions, modes, time_s);
      if (!work.has({WorkKind::basis, plan.bases[i]}))
        write_basis(work, plan.bases[i], reference_basis(reference.region, positions, mesh.node_ids, modes, time_s));
      stage.step();
    }
  });
  plan.bases_seconds = seconds_since(begin);
}

BakedTree build_vertex_tree(std::span<const float> positions) {
  BakedTree tree;
  tree.order.resize(positions.size() / 3);
  std::iota(tree.order.begin(), tree.order.end(), 0u);
  if (!tree.order.empty()) Builder(positions, tree).build(0, static_cast<std::uint32_t>(tree.order.size()));
  return tree;
}

}  // namespace lbea::bake
