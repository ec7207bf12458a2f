#include "precompute/registration/registration.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lbea::bake {
std::optional<double> unit_factor(double cloud_diagonal, double mesh_diagonal) {
  constexpr double slack = 0.4;  // decades: a cloud shows a part of the component, or more than it
  if (!(cloud_diagonal > 0 && mesh_diagonal > 0)) return std::nullopt;
  const double decades = std::log10(mesh_diagonal / cloud_diagonal);
  const double whole = std::round(decades);
  if (whole == 0 || std::abs(whole) > 3 || std::abs(decades - whole) > slack) return std::nullopt;
  return std::pow(10.0, whole);
}

std::vector<Point> far_points(std::span<const Point> points) {
  constexpr double near_share = 0.8, times = 10;
  std::vector<Point> finite;
  for (const Point& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) finite.push_back(p);
  if (finite.empty()) return {};
  const auto at = [&](double share) {
    return finite.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
  };
  Point middle;
  for (float Point::*const axis : {&Point::x, &Point::y, &Point::z}) {
    std::ranges::nth_element(finite, at(0.5), {}, axis);
    middle.*axis = (*at(0.5)).*axis;
  }
  const auto distance = [&](const Point& p) {
    return std::hypot(double{p.x} - double{middle.x}, double{p.y} - double{middle.y}, double{p.z} - double{middle.z});
  };
  std::ranges::nth_element(finite, at(near_share), {}, distance);
  const double limit = times * distance(*at(near_share));
  std::erase_if(finite, [&](const Point& p) { return distance(p) <= limit; });
  return finite;
}

std::string beyond_range(const Registration& found, const RegistrationSettings& settings) {
  if (found.shift <= settings.rough_shift && found.turn_deg <= settings.rough_turn_deg) return {};
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "the pose moved by %.4g and turned by %.3g degrees, more than the rough pose may be off (%.4g, %.3g "
                "degrees); check it, or register again from a better rough pose",
                found.shift, found.turn_deg, settings.rough_shift, settings.rough_turn_deg);
  return text.data();
}

std::string unexplained_points(const Registration& found) {
  constexpr double least_counted = 0.8;  // 30 % more points on a wall leave 0.83
  if (found.counted >= least_counted) return {};
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "%.0f %% of the points are not on the undeformed component: is it deformed already, or is something "
                "else in view? The pose may be less certain than stated",
                100 * (1 - found.counted));
  return text.data();
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
