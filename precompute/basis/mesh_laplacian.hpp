// Method step 5: the discrete Laplace-Beltrami operator of a surface mesh, L psi = lambda M psi.
#pragma once

#include "precompute/simulation.hpp"

#include <Eigen/SparseCore>

#include <cstddef>
#include <span>

namespace lbea::bake {
struct MeshLaplacian {
  Eigen::SparseMatrix<double> stiffness;  // L, n x n, cotangents, positive semi-definite, without unit
  Eigen::VectorXd mass;                   // diagonal of M, n, barycentric: a third of each adjoining triangle, area
  std::size_t degenerate_triangles = 0;   // of no area: skipped
};

/// positions: n x 3. Edges of three and more triangles are summed like any other; several components are fine.
/// A vertex without area around it gets the mass 0: no basis exists then.
/// Throws Error{bad_input} for an index that is not a vertex.
[[nodiscard]] MeshLaplacian mesh_laplacian(std::span<const float> positions, std::span<const Quad> elements);
}  // namespace lbea::bake
