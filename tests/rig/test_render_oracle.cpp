// Against every ray intersected with every triangle in double precision.
#include "precompute/rig/counter_random.hpp"
#include "tests/rig/scenes.hpp"

#include <doctest/doctest.h>

#include <limits>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

using Vector = std::array<double, 3>;
Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Distance in lengths of d, infinite for a miss; `margin` widens (or narrows) the triangle.
double crossing(const Vector& o, const Vector& d, const std::array<Vector, 3>& t, double margin) {
  const Vector e1 = minus(t[1], t[0]), e2 = minus(t[2], t[0]), h = cross(d, e2);
  const Vector s = minus(o, t[0]), q = cross(s, e1);
  const double a = dot(e1, h), u = dot(s, h) / a, v = dot(d, q) / a, distance = dot(e2, q) / a;
  const bool inside = u >= -margin && v >= -margin && u + v <= 1 + margin && distance > 0;
  return inside ? distance : std::numeric_limits<double>::infinity();
}

struct Oracle {
  std::vector<std::array<Vector, 3>> triangles;

  explicit Oracle(const Scene& scene) {
    const auto node = [&](std::uint32_t i) {
      const float* p = &scene.positions[std::size_t{3} * i];
      return Vector{p[0], p[1], p[2]};
    };
    for (const auto& e : scene.elements) {
      triangles.push_back({node(e[0]), node(e[1]), node(e[2])});
      triangles.push_back({node(e[0]), node(e[2]), node(e[3])});
    }
  }
  struct Hit {
    double distance = std::numeric_limits<double>::infinity();
    Vector normal{};
  };
  [[nodiscard]] Hit first(const Vector& origin, const Vector& direction, double margin) const {
    Hit nearest;
    for (const auto& t : triangles) {
      const double distance = crossing(origin, direction, t, margin);
      if (distance < nearest.distance) nearest = {distance, cross(minus(t[1], t[0]), minus(t[2], t[0]))};
    }
    return nearest;
  }
};

struct Depths {
  double low, high;
};
constexpr Depths in_front{900, 1500};

Scene random_quads(std::uint64_t seed, std::size_t quads, Depths depths = in_front) {
  Scene scene;
  std::uint64_t draw = 0;
  const auto number = [&](double from, double to) {
    return static_cast<float>(from + (to - from) * CounterRandom(seed, draw++).uniform(Draw::outlier));
  };
  for (std::size_t i = 0; i < quads; ++i) {
    const float x = number(-500, 500), y = number(-300, 300), z = number(depths.low, depths.high);
    std::array<std::array<float, 3>, 4> corners{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}};
    for (auto& corner : corners)
      corner = {x + 60 * corner[0] + number(-20, 20), y + 60 * corner[1] + number(-20, 20), z + number(-300, 300)};
    scene.add(corners);
  }
  return scene;
}

}  // namespace

TEST_CASE("depth, sides and occlusion agree with brute force wherever no edge is near") {
  std::size_t measured = 0, hidden = 0, other_side = 0, nothing = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Scene scene = random_quads(seed, 40);
    const Oracle oracle(scene);
    const auto image = look_at(scene).image({scene.positions}, 0);
    for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
      const Vector d{(static_cast<double>(pixel % 120) + 0.5 - 60) / 100,
                     (static_cast<double>(pixel / 120) + 0.5 - 40) / 100, 1};
      const auto wide = oracle.first({}, d, 1e-3), narrow = oracle.first({}, d, -1e-3);
      if (wide.distance != narrow.distance) continue;
      const double depth = wide.distance;
      REQUIRE(std::isnan(image.depth[pixel]) == std::isinf(depth));
      nothing += std::isinf(depth) ? 1u : 0u;
      if (std::isinf(depth)) continue;
      CHECK(image.depth[pixel] == doctest::Approx(depth).epsilon(1e-5));

      const Vector eye{baseline, 0, 0}, sight = minus({depth * d[0], depth * d[1], depth}, eye);
      const double blocked = oracle.first(eye, sight, 1e-3).distance;
      const double surely = oracle.first(eye, sight, -1e-3).distance;
      const double sides = dot(d, wide.normal) * dot(sight, wide.normal);
      const bool edge_near = blocked < 0.9995 && surely > 0.9995;
      const bool near_contact = std::abs(blocked - 0.9995) < 0.0004;
      const double lengths = std::sqrt(dot(sight, sight) * dot(wide.normal, wide.normal));
      const bool edge_on = std::abs(dot(sight, wide.normal)) < 1e-3 * lengths;
      if (edge_near || near_contact || edge_on || 100 * sight[0] / sight[2] < -59.99) continue;
      const bool expected = surely > 0.9995 && sides > 0;
      CHECK(image.measured[pixel] == (expected ? 1 : 0));
      measured += expected ? 1u : 0u;
      hidden += surely < 0.9995 ? 1u : 0u;
      other_side += sides < 0 ? 1u : 0u;
    }
  }
  CHECK(measured > 5000);
  CHECK(hidden > 500);
  CHECK(other_side > 10);
  CHECK(nothing > 500);
}

TEST_CASE("what extends behind the eye is seen as brute force sees it") {
  std::size_t seen = 0, behind = 0;
  for (const std::uint64_t seed : {4u, 5u, 6u, 7u}) {
    const Scene scene = random_quads(seed, 60, {-250, 450});
    for (std::size_t i = 2; i < scene.positions.size(); i += 3) behind += scene.positions[i] <= 0 ? 1u : 0u;
    const Oracle oracle(scene);
    const auto image = look_at(scene).image({scene.positions}, 0);
    for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
      const Vector d{(static_cast<double>(pixel % 120) + 0.5 - 60) / 100,
                     (static_cast<double>(pixel / 120) + 0.5 - 40) / 100, 1};
      const auto wide = oracle.first({}, d, 1e-3), narrow = oracle.first({}, d, -1e-3);
      if (wide.distance != narrow.distance) continue;
      REQUIRE(std::isnan(image.depth[pixel]) == std::isinf(wide.distance));
      if (std::isinf(wide.distance)) continue;
      CHECK(image.depth[pixel] == doctest::Approx(wide.distance).epsilon(1e-5));
      ++seen;
    }
  }
  CHECK(seen > 5000);
  CHECK(behind > 100);
}
