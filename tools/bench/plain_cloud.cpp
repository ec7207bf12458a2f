#include "tools/bench/plain_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::tool::bench {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double row(std::span<const float, 4> T, const Point& p) {
  return double{T[0]} * double{p.x} + double{T[1]} * double{p.y} + double{T[2]} * double{p.z} + double{T[3]};
}

// The farthest coordinate that the envelope holds.
double extent_of(const EnvelopeView& envelope) {
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    extent = std::max(extent, std::abs(double{envelope.corner[axis]}) + double{envelope.cell} * envelope.cells[axis]);
  return extent;
}

// Of a point that lands in the envelope: |p| = |R p| <= sqrt(3) (extent + |t|), and each row of R has length 1.
double largest_term_sum(const RigidTransform& T, double extent) {
  constexpr double root_of_3 = 1.7320509;
  const double translation = std::max({std::abs(T[3]), std::abs(T[7]), std::abs(T[11])});
  return root_of_3 * (extent + root_of_3 * translation) + translation;
}

bool holds(const EnvelopeView& envelope, const std::array<double, 3>& cell) {
  std::size_t place = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    if (!(cell[axis] >= 0) || !(cell[axis] < envelope.cells[axis])) return false;
    place = place * envelope.cells[axis] + static_cast<std::size_t>(cell[axis]);
  }
  return (envelope.bits[place / 64] >> (place % 64) & 1u) != 0;
}

// Looks at the corners of the box in which rounding may have put the point.
Membership membership_of(const Position& position, const EnvelopeView& envelope, double error) {
  std::size_t held = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::array<double, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double moved = position[axis] + ((corner >> axis & 1u) != 0 ? error : -error);
      cell[axis] = std::floor((moved - double{envelope.corner[axis]}) / double{envelope.cell});
    }
    held += holds(envelope, cell);
  }
  return held == 8 ? Membership::inside : held == 0 ? Membership::outside : Membership::boundary;
}

}  // namespace

PlainCloud::PlainCloud(std::span<const Point> points, const RigidTransform& T, const EnvelopeView& envelope)
    : positions(points.size()), membership(points.size(), Membership::outside) {
  constexpr double roundings = 4;  // of a product on its way through three sums
  const double extent = extent_of(envelope);
  position_error = roundings * float_rounding * largest_term_sum(T, extent);
  const double cell_error = 2 * position_error + 4 * float_rounding * extent;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions[i][axis] = row(std::span(T).subspan(4 * axis).first<4>(), points[i]);
    membership[i] = membership_of(positions[i], envelope, cell_error);
  }
}

double distance(const Position& a, const Position& b) noexcept {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

// Four vertices at a time: their minima do not wait for each other.
std::vector<double> nearest_distances(const PlainCloud& cloud, std::span<const std::array<float, 3>> vertices) {
  constexpr std::size_t width = 4;
  std::vector<Position> inside;
  for (std::size_t i = 0; i < cloud.positions.size(); ++i)
    if (cloud.membership[i] == Membership::inside) inside.push_back(cloud.positions[i]);
  std::vector<double> distances(vertices.size());
  for (std::size_t begin = 0; begin < vertices.size(); begin += width) {
    double q[width][3], least[width];
    for (std::size_t k = 0; k < width; ++k) {
      const auto& vertex = vertices[std::min(begin + k, vertices.size() - 1)];
      for (std::size_t axis = 0; axis < 3; ++axis) q[k][axis] = vertex[axis];
      least[k] = infinity;
    }
    for (const auto& [px, py, pz] : inside)
      for (std::size_t k = 0; k < width; ++k) {
        const double x = px - q[k][0], y = py - q[k][1], z = pz - q[k][2], squared = x * x + y * y + z * z;
        least[k] = squared < least[k] ? squared : least[k];
      }
    for (std::size_t k = 0; k < width && begin + k < vertices.size(); ++k) distances[begin + k] = std::sqrt(least[k]);
  }
  return distances;
}

}  // namespace lbea::tool::bench
