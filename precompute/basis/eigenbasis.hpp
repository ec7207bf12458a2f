// Method step 5: the p smallest eigenpairs of L psi = lambda M psi, the low frequencies of the surface.
#pragma once

#include "precompute/basis/mesh_laplacian.hpp"

#include <Eigen/Dense>

#include <cstdint>
#include <string>

namespace lbea::bake {

struct Eigenbasis {
  Eigen::VectorXd eigenvalues;  // p, ascending
  Eigen::MatrixXd modes;        // psi, n x p, psi' M psi = I; the entry of largest magnitude is positive
  double residual = 0;  // max over modes of |L psi - lambda M psi| in the norm of M^-1, relative to the largest lambda
  std::string solver;   // what found it, for people to read
};

/// Deterministic. Every eigenvalue is there as often as its multiplicity: the count below the last one is
/// verified by Sylvester's law of inertia and what is missing is searched in the rest of the space.
/// Entries within 1e-9 of the largest magnitude count as equal; the lowest vertex decides the sign.
/// Throws Error{bad_config} when p is 0 or more than the vertices, Error{bad_input} when a mass is not positive or
/// no basis passes the check.
[[nodiscard]] Eigenbasis eigenbasis(const MeshLaplacian& laplacian, std::uint32_t p);

}  // namespace lbea::bake
