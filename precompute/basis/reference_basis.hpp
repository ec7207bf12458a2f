// Method step 5: the basis on one reference mesh, as the model stores it: vertices in tree order, mass, eigenvalues,
// Psi' M.
#pragma once

#include "precompute/basis/eigenbasis.hpp"
#include "precompute/survey/reference.hpp"

namespace lbea::bake {
/// The KD-tree of runtime/FORMAT.md sections 38 and 39: flat, index-based, the same for the same points. Preorder: node
/// 0 is the root, the left child of node k is k + 1. No points, no nodes.
struct BakedTree {
  std::vector<std::uint32_t> order;                  // the points in the order of the leaves, ascending within a leaf
  std::vector<std::array<float, 6>> boxes;           // per node: min x, y, z, max x, y, z of its points
  std::vector<std::array<std::uint32_t, 3>> ranges;  // per node: first in `order`, count, right child (0: a leaf)
};

/// positions: n x 3, finite. Splits at the median of the box's longest side; equal coordinates by index.
[[nodiscard]] BakedTree build_vertex_tree(std::span<const float> positions);

/// n vertices in the order of the tree's leaves, p modes.
struct ReferenceBasis {
  double time_s = 0;                                   // since impact
  std::vector<std::uint32_t> vertex_nodes;             // n: vertex -> node of the common mesh
  std::vector<std::array<float, 3>> vertex_positions;  // n
  BakedTree tree;
  Eigen::VectorXd mass;         // n
  Eigen::VectorXd eigenvalues;  // p
  Eigen::MatrixXd projection;   // Psi' M, p x n
  double residual = 0;          // of the eigenpairs, see Eigenbasis
  std::string solver;
  std::size_t degenerate_triangles = 0;
};

/// positions: N x 3 of the common mesh in the reference state; node_ids: N, for messages.
/// Throws Error{bad_input} naming a node whose elements have no area in this state, and as eigenbasis() does.
[[nodiscard]] ReferenceBasis reference_basis(const ObservedRegion& region, std::span<const float> positions,
                                             std::span<const std::uint32_t> node_ids, std::uint32_t p, double time_s);

class WorkFolder;

/// The basis on every reference mesh, written to the work folder. Sets plan.bases to their keys and plan.bases_seconds.
/// Finished ones are not solved again.
void solve_bases(const WorkFolder& work, BakePlan& plan, const Reference& reference, const BakeOptions& options);
}  // namespace lbea::bake
