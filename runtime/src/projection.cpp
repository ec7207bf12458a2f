#include "runtime/src/projection.hpp"

#include <Eigen/Core>

namespace lbea {

void project(std::span<const float> projection, const Positions& positions, Positions& coefficients) noexcept {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto modes = static_cast<Eigen::Index>(coefficients.count);
  const auto columns = static_cast<Eigen::Index>(positions.planes[0].size());
  const Eigen::Map<const RowMajor> Vp(projection.data(), modes, columns);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Map<const Eigen::VectorXf> f(positions.planes[axis].data(), columns);
    Eigen::Map<Eigen::VectorXf> alpha(coefficients.planes[axis].data(), modes);
    for (Eigen::Index j = 0; j < modes; ++j) alpha[j] = Vp.row(j).dot(f);  // a dot allocates nothing
  }
}

}  // namespace lbea
