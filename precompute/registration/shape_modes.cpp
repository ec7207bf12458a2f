#include "precompute/registration/shape_modes.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace lbea::bake {

ShapeModes shape_modes(std::span<const std::span<const float>> shapes, double least, std::size_t most) {
  ShapeModes result;
  if (shapes.empty()) return result;
  const std::size_t values = shapes.front().size();
  const double count = static_cast<double>(shapes.size());
  std::vector<double> mean(values);
  for (const auto& shape : shapes)
    for (std::size_t i = 0; i < values; ++i) mean[i] += double{shape[i]} / count;
  result.mean.assign(mean.begin(), mean.end());

  const auto n = static_cast<Eigen::Index>(shapes.size());
  Eigen::MatrixXd off(static_cast<Eigen::Index>(values), n);
  for (Eigen::Index s = 0; s < n; ++s)
    for (std::size_t i = 0; i < values; ++i)
      off(static_cast<Eigen::Index>(i), s) = double{shapes[static_cast<std::size_t>(s)][i]} - mean[i];
  // The small side's eigenvectors: off' off v = lambda v; off v / sqrt(count) is the mode times its standard deviation.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(off.transpose() * off);
  const double nodes = static_cast<double>(values / 3);
  for (Eigen::Index k = n; k-- > 0 && result.modes.size() < most;) {
    const double size = std::sqrt(std::max(solver.eigenvalues()(k), 0.0) / (count * nodes));
    if (!(size >= least)) break;
    const Eigen::VectorXd mode = off * solver.eigenvectors().col(k) / std::sqrt(count);
    result.modes.emplace_back(mode.data(), mode.data() + mode.size());
  }
  return result;
}

}  // namespace lbea::bake
