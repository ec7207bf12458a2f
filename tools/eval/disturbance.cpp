#include "tools/eval/disturbance.hpp"

#include "precompute/rig/counter_random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace lbea::tool {
namespace {

constexpr double patch_radius = 0.07;  // of the box's diagonal

/// Numbers in [0, 1), one after another.
class Sequence {
 public:
  explicit Sequence(std::uint64_t seed) : key_(bake::splitmix(seed)) {}
  double next() { return static_cast<double>(bake::splitmix(key_ ^ ++count_) >> 11) * 0x1p-53; }

 private:
  std::uint64_t key_, count_ = 0;
};

double squared_distance(const Point& a, const Point& b) {
  const double x = double{a.x} - double{b.x}, y = double{a.y} - double{b.y}, z = double{a.z} - double{b.z};
  return x * x + y * y + z * z;
}

double diagonal(const std::vector<Point>& points) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Point low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  for (const Point& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return points.empty() ? 0 : std::sqrt(squared_distance(low, high));
}

}  // namespace

bake::SensingNoise disturbed(bake::SensingNoise noise, const Disturbance& disturbance) {
  noise.sigma = disturbance.noise.value_or(noise.sigma);
  noise.outliers = disturbance.outliers.value_or(noise.outliers);
  return noise;
}

std::vector<Point> hide_patches(std::vector<Point> points, double share, double radius, std::uint64_t seed) {
  const auto remain =
      static_cast<std::size_t>(std::lround(static_cast<double>(points.size()) * (1 - std::clamp(share, 0.0, 1.0))));
  Sequence random(seed);
  std::vector<double> distances;
  while (points.size() > remain) {
    const Point centre = points[static_cast<std::size_t>(random.next() * static_cast<double>(points.size()))];
    distances.clear();
    for (const Point& p : points) distances.push_back(squared_distance(p, centre));
    const std::size_t most = points.size() - remain;
    auto sorted = distances;
    std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(most - 1));
    const double limit = std::min(radius * radius, sorted[most - 1]);
    std::size_t at = 0;
    std::erase_if(points, [&](const Point&) { return distances[at++] <= limit; });
  }
  return points;
}

std::vector<Point> thin(std::vector<Point> points, double share, std::uint64_t seed) {
  Sequence random(seed);
  std::erase_if(points, [&](const Point&) { return random.next() >= share; });
  return points;
}

// Rodrigues: R = I + sin a K + (1 - cos a) K K, with K = [axis]x; T' = turn about the centre after T.
RigidTransform turned(const RigidTransform& T, double degrees, const Point& centre, std::uint64_t seed) {
  Sequence random(seed);
  const double z = 2 * random.next() - 1, around = 2 * std::numbers::pi * random.next(), flat = std::sqrt(1 - z * z);
  const std::array<double, 3> axis{flat * std::cos(around), flat * std::sin(around), z};
  const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
  const std::array<double, 9> K{0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
  std::array<double, 9> R{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      R[3 * i + j] = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j] + s * K[3 * i + j];
  const std::array<double, 3> about{double{centre.x}, double{centre.y}, double{centre.z}};
  RigidTransform result{};
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = about[i];
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) result[4 * i + j] += static_cast<float>(R[3 * i + k] * double{T[4 * k + j]});
      shift += R[3 * i + k] * (double{T[4 * k + 3]} - about[k]);
    }
    result[4 * i + 3] = static_cast<float>(shift);
  }
  return result;
}

std::vector<Point> disturbed(std::vector<Point> points, const Disturbance& disturbance, std::uint64_t seed) {
  if (disturbance.hidden > 0) {
    const double radius = patch_radius * diagonal(points);
    points = hide_patches(std::move(points), disturbance.hidden, radius, bake::splitmix(seed ^ 1));
  }
  if (disturbance.kept < 1) points = thin(std::move(points), disturbance.kept, bake::splitmix(seed ^ 2));
  return points;
}

}  // namespace lbea::tool
