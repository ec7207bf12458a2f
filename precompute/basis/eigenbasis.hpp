// Method step 5: the p smallest eigenpairs of L psi = lambda M psi, the low frequencies of the surface.
#pragma once

#include "precompute/basis/mesh_laplacian.hpp"

#include <Eigen/Dense>

namespace lbea::bake {
struct Eigenbasis {
  Eigen::VectorXd eigenvalues;  // p, ascending
  Eigen::MatrixXd modes;        // psi, n x p, psi' M psi = I; the entry of largest magnitude is positive
  double residual = 0;  // max over modes of |L psi - lambda M psi| in the norm of M^-1, relative to the largest lambda
  std::string solver;   // name of the solver, for reports
};

/// Deterministic. Every eigenvalue appears with its multiplicity: the count below the last one is verified by
/// Sylvester's law of inertia, and missing ones are searched in the rest of the space. Entries within 1e-9 of the
/// largest magnitude count as equal; the lowest vertex decides the sign. Throws Error{bad_config} when p is 0 or larger
/// than the number of vertices, Error{bad_input} when a mass is not positive or no basis passes the check.
[[nodiscard]] Eigenbasis eigenbasis(const MeshLaplacian& laplacian, std::uint32_t p);

/// Number of eigenvalues of the symmetric A below `shift`: the negative pivots of A - shift I = P' L D L' P
/// (Sylvester). Throws Error{bad_input} when the factorization fails.
[[nodiscard]] Eigen::Index eigenvalues_below(const Eigen::SparseMatrix<double>& a, double shift);
}  // namespace lbea::bake
