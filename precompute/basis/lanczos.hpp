// The largest eigenpairs of a symmetric operator.
#pragma once

#include "precompute/dense/symmetric_eigenpairs.hpp"

#include <functional>

namespace lbea::bake {

/// y = A x.
using SymmetricOperator = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& y)>;

/// The `count` largest eigenvalues, descending, of a positive semidefinite operator of n dimensions, by Lanczos' method
/// with thick restarts (Wu and Simon 2000) in at most `space` dimensions, from A `start`. Residuals are at most
/// `tolerance` times the eigenvalue. Of a multiple eigenvalue, some vectors may be missing. Without pairs when it does
/// not converge.
[[nodiscard]] Eigenpairs largest_eigenpairs(const SymmetricOperator& a, const Eigen::VectorXd& start,
                                            Eigen::Index count, Eigen::Index space, double tolerance);

}  // namespace lbea::bake
