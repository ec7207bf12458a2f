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

Vec3 at_depth(const Rig& rig, std::size_t pixel, double depth) {
  const std::size_t width = rig.plane.width();
  const auto column = static_cast<std::uint32_t>(pixel % width), row = static_cast<std::uint32_t>(pixel / width);
  const Vec3 d = rig.plane.direction(column, row);
  return {depth * d.x, depth * d.y, depth};
}

/// The point with its errors, all of them along the line of sight.
Point disturbed(const Vec3& p, const SensingNoise& noise, const CounterRandom& random) {
  double stretch = 1 + noise.sigma * random.normal() / norm(p);
  if (random.uniform(Draw::outlier) < noise.outliers)
    stretch += outlier_reach * (2 * random.uniform(Draw::outlier_size) - 1);
  return {static_cast<float>(stretch * p.x), static_cast<float>(stretch * p.y), static_cast<float>(stretch * p.z)};
}

double wall_depth(const Rig& rig, const PlacedMesh& mesh) {
  double farthest = 0;
  for (std::uint32_t node = 0; node < rig.nodes; ++node) {
    const double depth = mesh.node(node).z;
    if (std::isfinite(depth)) farthest = std::max(farthest, depth);
  }
  return wall_distance * farthest;
}

/// A wall behind the component. Each pixel that misses the component shows it with the probability that gives the
/// requested share on average.
struct Background {
  double depth = 0, probability = 0;

  Background(const Rig& rig, const PlacedMesh& mesh, const SensorImage& image, float share) {
    const auto measured = std::count(image.measured.begin(), image.measured.end(), 1);
    const auto empty = std::count(image.element.begin(), image.element.end(), no_element);
    if (share <= 0 || measured == 0 || empty == 0) return;
    depth = wall_depth(rig, mesh);
    probability = share * static_cast<double>(measured) / static_cast<double>(empty);
  }
};
}  // namespace

std::vector<Point> measure(const Rig& rig, const PlacedMesh& mesh, const SensingNoise& noise, std::uint64_t seed) {
  check_noise(noise);
  const SensorImage image = mesh.render(noise.min_cos_incidence);
  const Background background(rig, mesh, image, noise.background);
  const auto shows_wall = [&](std::size_t pixel, const CounterRandom& random) {
    if (image.element[pixel] != no_element) return false;
    if (random.uniform(Draw::background) >= background.probability) return false;
    const Vec3 point = at_depth(rig, pixel, background.depth);
    return rig.in_right_image(point) && !mesh.hidden_from_right(point);
  };
  std::vector<Point> points;
  for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
    const CounterRandom random(seed, pixel);
    if (random.uniform(Draw::dropout) < noise.dropout) continue;
    if (image.measured[pixel] != 0)
      points.push_back(disturbed(at_depth(rig, pixel, image.depth[pixel]), noise, random));
    else if (background.probability > 0 && shows_wall(pixel, random))
      points.push_back(disturbed(at_depth(rig, pixel, background.depth), noise, random));
  }
  return points;
}
}  // namespace lbea::bake::sensing
