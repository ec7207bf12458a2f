// The inverse of a large symmetric positive definite matrix.
#pragma once

#include <Eigen/Core>

namespace lbea::bake {

/// The same bits on every processor, unlike products of a library, whose order of summation depends on cache sizes. By
/// block-wise sweeps (Goodnight 1979), n^3 / 2 multiplications.
[[nodiscard]] Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& matrix);

}  // namespace lbea::bake
