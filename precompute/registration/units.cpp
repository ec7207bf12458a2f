#include "precompute/registration/registration.hpp"

#include <algorithm>
#include <array>
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

}  // namespace lbea::bake
