#include "precompute/dense/symmetric_eigenpairs.hpp"

#include <Eigen/Eigenvalues>

namespace lbea::bake {

Eigenpairs eigenpairs_of_symmetric(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace lbea::bake
