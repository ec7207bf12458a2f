#include "precompute/rig/counter_random.hpp"
#include "precompute/rig/rig.hpp"

#include <algorithm>

namespace lbea::bake::sensing {
namespace {
constexpr double outlier_reach = 0.03;  // share of the distance
constexpr double wall_distance = 1.2;   // times the depth of the farthest node

void check_number(const char* name, float value, float most) {
  if (std::isfinite(value) && value >= 0 && value <= most) return;
  throw Error{Status::bad_config, std::string("the sensor noise's ") + name + " of " + std::to_string(value) +
                                      (most <= 1 ? " is not between 0 and 1" : " is negative or not finite")};
}

void check_noise(const SensingNoise& noise) {
  check_number("sigma", noise.sigma, std::numeric_limits<float>::max());
  check_number("outliers", noise.outliers, 1);
  check_number("min_cos_incidence", noise.min_cos_incidence, 1);
  check_number("dropout", noise.dropout, 1);
  check_number("background", noise.background, std::numeric_limits<float>::max());
}

/// The point with its errors, all of them along the line of sight.
Point disturbed(const Vec3& p, const SensingNoise& noise, const CounterRandom& random) {
  double stretch = 1 + noise.sigma * random.normal() / norm(p);
  if (random.uniform(Draw::outlier) < noise.outliers)
    stretch += outlier_reach * (2 * random.uniform(Draw::outlier_size) - 1);
  return {static_cast<float>(stretch * p.x), static_cast<float>(stretch * p.y), static_cast<float>(stretch * p.z)};
}

double wall_depth(const PlacedMesh& mesh) {
  double farthest = 0;
  for (const Vec3& node : mesh.nodes())
    if (std::isfinite(node.z)) farthest = std::max(farthest, node.z);
  return wall_distance * farthest;
}

/// A wall behind the component. Each pixel that misses the component shows it with the probability that gives the
/// requested share on average.
struct Background {
  double depth = 0, probability = 0;

  Background(const PlacedMesh& mesh, const SensorImage& image, float share) {
    const auto measured = std::count(image.measured.begin(), image.measured.end(), 1);
    const auto empty = std::count(image.element.begin(), image.element.end(), no_element);
    if (share <= 0 || measured == 0 || empty == 0) return;
    depth = wall_depth(mesh);
    probability = share * static_cast<double>(measured) / static_cast<double>(empty);
  }

  /// One per pixel: 1 where it shows the wall and the right camera sees the same point. Empty without background.
  [[nodiscard]] std::vector<std::uint8_t> seen(const Rig& rig, PlacedMesh& mesh, const SensorImage& image,
                                               std::uint64_t seed) const {
    if (probability == 0) return {};
    std::vector<std::size_t> pixels;
    std::vector<Vec3> points;
    for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
      if (image.element[pixel] != no_element) continue;
      if (CounterRandom(seed, pixel).uniform(Draw::background) >= probability) continue;
      pixels.push_back(pixel);
      points.push_back(rig.plane.at_depth(pixel, depth));
    }
    const auto is_seen = mesh.seen_from_right(points);
    std::vector<std::uint8_t> result(image.pixels(), 0);
    for (std::size_t i = 0; i < pixels.size(); ++i) result[pixels[i]] = is_seen[i];
    return result;
  }
};
}  // namespace

std::vector<Point> measure(const Rig& rig, PlacedMesh& mesh, const SensingNoise& noise, std::uint64_t seed) {
  check_noise(noise);
  SensorImage image;
  mesh.render(noise.min_cos_incidence, image);
  const Background background(mesh, image, noise.background);
  const auto wall = background.seen(rig, mesh, image, seed);
  std::vector<Point> points;
  for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
    const CounterRandom random(seed, pixel);
    if (random.uniform(Draw::dropout) < noise.dropout) continue;
    if (image.measured[pixel] != 0)
      points.push_back(disturbed(rig.plane.at_depth(pixel, double{image.depth[pixel]}), noise, random));
    else if (!wall.empty() && wall[pixel] != 0)
      points.push_back(disturbed(rig.plane.at_depth(pixel, background.depth), noise, random));
  }
  return points;
}
}  // namespace lbea::bake::sensing
