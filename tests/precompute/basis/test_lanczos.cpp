#include "precompute/basis/lanczos.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea::bake;
using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

namespace {

/// Eigenvalues 1, 1/2, 1/3, ..., as the inverse of a surface's Laplacian has, in the coordinates' directions.
VectorXd harmonic(Index n) { return VectorXd::LinSpaced(n, 1, static_cast<double>(n)).cwiseInverse(); }

VectorXd all_directions(Index n) { return VectorXd::LinSpaced(n, 1, 2); }

}  // namespace

TEST_CASE("eigenpairs are found after restarts in a small space, orthonormal to rounding") {
  constexpr Index n = 500, count = 12;
  const VectorXd diagonal = harmonic(n);
  Index products = 0;
  const SymmetricOperator a = [&](const VectorXd& x, VectorXd& y) {
    y = diagonal.cwiseProduct(x);
    ++products;
  };
  const Eigenpairs pairs = largest_eigenpairs(a, all_directions(n), count, 20, 1e-12);
  CHECK(products > 20 + 1);
  REQUIRE(pairs.values.size() == count);
  CHECK((pairs.values - diagonal.head(count)).cwiseAbs().maxCoeff() < 1e-13);
  CHECK((pairs.vectors.transpose() * pairs.vectors - MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff() < 1e-13);
  const MatrixXd residuals =
      diagonal.asDiagonal() * pairs.vectors - pairs.vectors * pairs.values.asDiagonal().toDenseMatrix();
  for (Index k = 0; k < count; ++k) CHECK(residuals.col(k).norm() < 2e-12 * pairs.values[k]);
}

TEST_CASE("a space that the operator does not leave is completed by other vectors") {
  constexpr Index n = 40;
  VectorXd diagonal = VectorXd::Constant(n, 0.5);  // two eigenvalues: Krylov spaces have two dimensions
  diagonal.head(3).setOnes();
  const SymmetricOperator a = [&](const VectorXd& x, VectorXd& y) { y = diagonal.cwiseProduct(x); };
  const Eigenpairs pairs = largest_eigenpairs(a, all_directions(n), 5, 10, 1e-12);
  REQUIRE(pairs.values.size() == 5);
  CHECK(pairs.values[0] == doctest::Approx(1).epsilon(1e-13));
  CHECK((pairs.vectors.transpose() * pairs.vectors - MatrixXd::Identity(5, 5)).cwiseAbs().maxCoeff() < 1e-13);
  for (const double value : pairs.values) CHECK((std::abs(value - 1) < 1e-13 || std::abs(value - 0.5) < 1e-13));
}

TEST_CASE("in the whole space all eigenvalues are found") {
  constexpr Index n = 15;
  const VectorXd diagonal = harmonic(n);
  const SymmetricOperator a = [&](const VectorXd& x, VectorXd& y) { y = diagonal.cwiseProduct(x); };
  const Eigenpairs pairs = largest_eigenpairs(a, all_directions(n), n, n, 1e-12);
  CHECK((pairs.values - diagonal).cwiseAbs().maxCoeff() < 1e-14);
}
