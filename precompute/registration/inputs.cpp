#include "precompute/registration/registration.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace lbea::bake {
std::optional<double> unit_factor(double cloud_diagonal, double mesh_diagonal) {
  constexpr double slack = 0.4;  // decades: a cloud shows a part of the component, or more than it
  if (!(cloud_diagonal > 0 && mesh_diagonal > 0)) return std::nullopt;
  const double decades = std::log10(mesh_diagonal / cloud_diagonal);
  const double whole = std::round(decades);
  if (whole == 0 || std::abs(whole) > 3 || std::abs(decades - whole) > slack) return std::nullopt;
  return std::pow(10.0, whole);
}

double robust_diagonal(std::span<const Point> points) {
  double squares = 0;
  for (float Point::*const axis : {&Point::x, &Point::y, &Point::z}) {
    std::vector<float> values;
    for (const Point& p : points)
      if (std::isfinite(p.*axis)) values.push_back(p.*axis);
    if (values.empty()) return 0;
    const std::size_t cut = values.size() / 100;
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(cut),
               high = values.end() - 1 - static_cast<std::ptrdiff_t>(cut);
    std::ranges::nth_element(values, low);
    const double least = double{*low};
    std::ranges::nth_element(values, high);
    squares += (double{*high} - least) * (double{*high} - least);
  }
  return std::sqrt(squares);
}

double box_diagonal(std::span<const float> positions) {
  std::vector<Point> nodes;
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
    nodes.push_back({positions[i], positions[i + 1], positions[i + 2]});
  if (nodes.empty()) return 0;
  double squares = 0;
  for (float Point::*const axis : {&Point::x, &Point::y, &Point::z}) {
    const auto [low, high] = std::ranges::minmax(nodes, {}, axis);
    squares += std::pow(double{high.*axis} - double{low.*axis}, 2);
  }
  return std::sqrt(squares);
}

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
