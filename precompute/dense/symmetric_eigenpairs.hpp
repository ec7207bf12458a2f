// Eigenpairs of a dense symmetric matrix. The solver is compiled once; in every source that used it, it took seconds.
#pragma once

#include <Eigen/Core>

namespace lbea::bake {

struct Eigenpairs {
  Eigen::VectorXd values;   // as the functions that return them order them
  Eigen::MatrixXd vectors;  // orthonormal columns
};

/// All of them, ascending. Reads the lower triangle.
[[nodiscard]] Eigenpairs eigenpairs_of_symmetric(const Eigen::MatrixXd& matrix);

}  // namespace lbea::bake
