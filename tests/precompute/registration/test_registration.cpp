// Components of plates before a stereo rig, filmed by the virtual sensor, registered from a rough pose.
#include "precompute/registration/alignment.hpp"
#include "precompute/registration/registration.hpp"
#include "precompute/registration/surface_tree.hpp"
#include "precompute/rig/virtual_sensor.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <ctime>
#include <numbers>
#include <random>

using namespace lbea;
using namespace lbea::bake;

namespace {

using Vec = std::array<double, 3>;

constexpr double noise = 0.1;  // mm

struct Component {
  std::vector<float> positions;
  std::vector<std::array<std::uint32_t, 4>> elements;

  /// A grid of n x n quads; place(u, v) with u, v in [0, 1].
  template <class Place>
  void add(std::uint32_t n, const Place& place) {
    const auto first = static_cast<std::uint32_t>(positions.size() / 3);
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i) {
        const Vec p = place(double(i) / n, double(j) / n);
        for (const double value : p) positions.push_back(static_cast<float>(value));
      }
    for (std::uint32_t j = 0; j < n; ++j)
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = first + j * (n + 1) + i;
        elements.push_back({a, a + 1, a + n + 2, a + n + 1});
      }
  }
};

/// Three walls of a box, seen from its corner.
Component corner_box() {
  Component box;
  box.add(10, [](double u, double v) { return Vec{100 * u, 80 * v, 60}; });
  box.add(10, [](double u, double v) { return Vec{100 * u, 80, 60 * v}; });
  box.add(10, [](double u, double v) { return Vec{100, 80 * u, 60 * v}; });
  return box;
}
Component plate(double size) {
  Component flat;
  flat.add(12, [=](double u, double v) { return Vec{size * (u - 0.5), size * (v - 0.5), 0}; });
  return flat;
}
Component tube() {
  Component round;
  round.add(40, [](double u, double v) {
    return Vec{200 * (u - 0.5), 40 * std::cos(2 * std::numbers::pi * v), 40 * std::sin(2 * std::numbers::pi * v)};
  });
  return round;
}

/// A rig 700 mm away along `from`, looking at `at`.
StereoSensor rig(const Eigen::Vector3d& from, const Eigen::Vector3d& at) {
  StereoSensor sensor;
  sensor.focal_px = 900;
  sensor.width_px = 360;
  sensor.height_px = 300;
  const Eigen::Vector3d z = -from.normalized(), x = z.unitOrthogonal(), y = z.cross(x);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << x, y, z;
  pose.translation() = at - 700 * z;
  sensor.T_reference_sensor = to_transform(pose);
  pose.translation() += 60 * x;
  sensor.T_reference_right = to_transform(pose);
  return sensor;
}

std::vector<Point> filmed(const Component& component, const StereoSensor& sensor) {
  const VirtualSensor camera(sensor, component.positions.size() / 3, component.elements);
  return camera.sense({component.positions}, {static_cast<float>(noise), 0.001f, 0.17f, 0, 0}, 3);
}

RegistrationSettings settings() {
  RegistrationSettings s;
  s.noise = noise;
  return s;
}

/// 20 mm and 5 degrees off about the component, in random directions.
RigidTransform roughened(const RigidTransform& T, const Eigen::Vector3d& about, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  Vector6 motion;
  motion << direction() * (5 * std::numbers::pi / 180), direction() * 20;
  return to_transform(motion_about(about, 1, motion) * to_isometry(T));
}

/// The largest distance between where the two poses put a point of the cloud.
double apart(const RigidTransform& a, const RigidTransform& b, const std::vector<Point>& points) {
  double most = 0;
  for (const Point& p : points) {
    const Eigen::Vector3d q(double{p.x}, double{p.y}, double{p.z});
    most = std::max(most, (to_isometry(a) * q - to_isometry(b) * q).norm());
  }
  return most;
}

Registration registered(const Component& component, const StereoSensor& sensor, const RigidTransform& rough) {
  return register_cloud({component.positions, component.elements}, filmed(component, sensor), rough, settings());
}

}  // namespace

TEST_CASE("a box corner is registered within the sensor's noise from 20 mm and 5 degrees off") {
  const Component box = corner_box();
  const StereoSensor sensor = rig({1, 1, 1}, {60, 50, 40});
  const auto points = filmed(box, sensor);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const RigidTransform rough = roughened(sensor.T_reference_sensor, {60, 50, 40}, seed);
    const Registration result = registered(box, sensor, rough);
    CHECK(apart(result.T_reference_sensor, sensor.T_reference_sensor, points) < noise);
    CHECK_MESSAGE(!result.ambiguous(), result.doubt);
    // Noise along the line of sight, seen at cos > 0.17 from the normal: distances from the surface are smaller.
    CHECK(result.residual < noise);
    CHECK(result.counted > 0.99);
    CHECK(result.shift > 0.5);
    CHECK(result.least_certain.sensitivity > 0.1);
  }
}

TEST_CASE("a plate larger than the image is ambiguous in its plane; the edges of a smaller one determine its pose") {
  const StereoSensor sensor = rig({0, 0, 1}, {0, 0, 0});
  const Registration slides = registered(plate(800), sensor, sensor.T_reference_sensor);
  CHECK(slides.ambiguous());
  CHECK(slides.least_certain.sensitivity < 0.01);
  CHECK(std::abs(slides.least_certain.shift[2]) < 0.01);  // in the plate
  const Component small = plate(120);
  const RigidTransform rough = roughened(sensor.T_reference_sensor, {0, 0, 0}, 4);
  const Registration held = registered(small, sensor, rough);
  CHECK_MESSAGE(!held.ambiguous(), held.doubt);
  // An edge is known to within half the distance between neighbouring points, 700 / 900 mm.
  CHECK(apart(held.T_reference_sensor, sensor.T_reference_sensor, filmed(small, sensor)) < noise + 0.5 * 700 / 900);
}

TEST_CASE("the rotation of a tube about its axis is reported as undetermined") {
  const Component round = tube();
  const StereoSensor sensor = rig({0, 0.3, 1}, {0, 0, 0});
  const Registration result = registered(round, sensor, roughened(sensor.T_reference_sensor, {0, 0, 0}, 2));
  CHECK(result.ambiguous());
  const Eigen::Vector3d turn(result.least_certain.turn.data());
  CHECK(std::abs(turn.normalized().x()) > 0.99);
  // Whatever its turn, the tube lies where it is: the axis' ends differ by less than the edges' half pixel.
  for (const double x : {-100.0, 100.0}) {
    const Eigen::Vector3d end(x, 0, 0);
    const Eigen::Vector3d moved =
        to_isometry(result.T_reference_sensor) * (to_isometry(sensor.T_reference_sensor).inverse() * end);
    CHECK((moved - end).norm() < noise + 0.5 * 700 / 900);
  }
}

TEST_CASE("shape and pose are separated when the shape modes are known") {
  // The plate of the box at z = 60 bulges by 2 mm; two shapes, bulging and not, have one mode of 1 mm.
  Component flat = corner_box(), bulging = flat;
  for (std::size_t i = 0; i < 121; ++i) {
    const double u = static_cast<double>(bulging.positions[3 * i]) / 100,
                 v = static_cast<double>(bulging.positions[3 * i + 1]) / 80;
    bulging.positions[3 * i + 2] +=
        static_cast<float>(2 * std::sin(std::numbers::pi * u) * std::sin(std::numbers::pi * v));
  }
  const std::array<std::span<const float>, 2> shapes{flat.positions, bulging.positions};
  const ShapeModes known = shape_modes(shapes, 0.01);
  REQUIRE(known.modes.size() == 1);
  const StereoSensor sensor = rig({1, 1, 1}, {60, 50, 40});
  const auto points = filmed(bulging, sensor);
  const RigidTransform rough = roughened(sensor.T_reference_sensor, {60, 50, 40}, 7);
  const Registration with = register_cloud({known.mean, flat.elements, known.modes}, points, rough, settings());
  const Registration without = register_cloud({known.mean, flat.elements}, points, rough, settings());
  CHECK(apart(with.T_reference_sensor, sensor.T_reference_sensor, points) < noise);
  CHECK(std::abs(std::abs(with.shape.at(0)) - 1) < 0.1);
  CHECK(with.residual < noise);
  CHECK(without.residual > 2 * with.residual);
}

TEST_CASE("clouds that cannot be registered are refused with a reason") {
  const Component box = corner_box();
  const StereoSensor sensor = rig({1, 1, 1}, {60, 50, 40});
  const ReferenceSurface surface{box.positions, box.elements};
  const auto points = filmed(box, sensor);
  const std::vector<Point> few(points.begin(), points.begin() + 99), none;
  CHECK_THROWS_AS(register_cloud(surface, few, sensor.T_reference_sensor), Error);
  CHECK_THROWS_AS(register_cloud(surface, none, sensor.T_reference_sensor), Error);
  CHECK_THROWS_AS(register_cloud({}, points, sensor.T_reference_sensor), Error);
  RigidTransform away = sensor.T_reference_sensor;
  away[3] += 5000;
  CHECK_THROWS_AS(register_cloud(surface, points, away), Error);
  const auto nothing_seen = [&](const RigidTransform&) { return std::vector<std::uint8_t>(box.elements.size(), 0); };
  CHECK_THROWS_AS(register_cloud({box.positions, box.elements, {}, nothing_seen}, points, sensor.T_reference_sensor),
                  Error);
}

TEST_CASE("different units are detected by powers of ten") {
  CHECK(unit_factor(0.4, 400) == 1000);
  CHECK(unit_factor(400'000, 400) == 0.001);
  CHECK(unit_factor(41, 400) == doctest::Approx(10));
  CHECK(unit_factor(2 * 0.4, 400) == 1000);  // the cloud shows more than the component
  CHECK(unit_factor(0.5 * 0.4, 400) == 1000);
  for (const double cloud : {400.0, 200.0, 900.0, 0.0, 4e-5}) CHECK(!unit_factor(cloud, 400));
  CHECK(!unit_factor(400, 0));
}

TEST_CASE("a few points far away are no other unit") {
  std::vector<Point> points;
  for (int i = 0; i < 950; ++i)
    points.push_back({static_cast<float>(i % 30), static_cast<float>(i / 30), 900 + static_cast<float>(i % 7)});
  points.push_back({NAN, 0, 0});
  CHECK(far_points(points).empty());
  for (int i = 0; i < 50; ++i) points.push_back({-9999, -9999, -9999});
  const std::vector<Point> far = far_points(points);
  REQUIRE(far.size() == 50);
  CHECK(far[0].x == -9999);
  CHECK(far_points({}).empty());
}

TEST_CASE("a pose beyond the searched range is doubtful") {
  Registration found;
  found.shift = 19;
  found.turn_deg = 4.9;
  CHECK(beyond_range(found, {}).empty());
  found.shift = 35;
  CHECK(beyond_range(found, {}).starts_with("the pose moved by 35 and turned by 4.9 degrees, more than"));
  found.shift = 1;
  found.turn_deg = 6;
  CHECK_FALSE(beyond_range(found, {}).empty());
}

// Regression: the pose by clouds of a deformed component was 10 mm wrong, without a word.
TEST_CASE("a pose is doubtful if many points are not on the undeformed component") {
  Registration found;
  found.counted = 0.85;
  CHECK(unexplained_points(found).empty());
  found.counted = 0.73;
  CHECK(unexplained_points(found).starts_with("27 % of the points are not on the undeformed component"));
}

TEST_CASE("a box's diagonal, with and without its outermost hundredth") {
  std::vector<Point> points;
  for (int i = 0; i <= 1000; ++i) points.push_back({0.003f * static_cast<float>(i), 0.004f * static_cast<float>(i), 7});
  points.push_back({1000, -1000, 1000});  // an outlier
  points.push_back({NAN, 0, 0});
  CHECK(robust_diagonal(points) == doctest::Approx(5 * 0.98).epsilon(0.005));
  CHECK(robust_diagonal({}) == 0);
  CHECK(box_diagonal(std::vector<float>{0, 0, 0, 3, 4, 0}) == 5);
  CHECK(box_diagonal({}) == 0);
}

TEST_CASE("the nearest place on a surface is the brute-force one") {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> positions(3 * 60);
  for (float& value : positions) value = uniform(random);
  std::vector<std::array<std::uint32_t, 4>> elements;
  for (std::uint32_t e = 0; e + 3 < 60; ++e) elements.push_back({e, e + 1, e + 2, e % 3 == 0 ? e + 2 : e + 3});
  const SurfaceTree tree(positions, elements);
  for (int i = 0; i < 200; ++i) {
    const Vec p{double{2 * uniform(random)}, double{2 * uniform(random)}, double{2 * uniform(random)}};
    const SurfacePlace place = tree.nearest(p);
    // Place, shares and distance agree with each other.
    Vec rebuilt{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        rebuilt[axis] += place.shares[k] * double{positions[3 * place.nodes[k] + axis]};
    CHECK(std::hypot(rebuilt[0] - p[0], rebuilt[1] - p[1], rebuilt[2] - p[2]) == doctest::Approx(place.distance));
    for (const double share : place.shares) CHECK(share >= -1e-12);
    // No place of a fine grid of barycentric shares on any triangle is nearer; the grid's nearest is at most a cell
    // away.
    double least = 1e9;
    for (const auto& q : elements)
      for (const auto& t : {std::array{q[0], q[1], q[2]}, std::array{q[0], q[2], q[3]}})
        for (int a = 0; a <= 20; ++a)
          for (int b = 0; a + b <= 20; ++b) {
            Vec at{};
            const std::array<double, 3> shares{a / 20.0, b / 20.0, (20 - a - b) / 20.0};
            for (std::size_t k = 0; k < 3; ++k)
              for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += shares[k] * double{positions[3 * t[k] + axis]};
            least = std::min(least, std::hypot(at[0] - p[0], at[1] - p[1], at[2] - p[2]));
          }
    CHECK(place.distance <= least + 1e-9);
    CHECK(place.distance > least - 2 * std::sqrt(12.0) / 20);
  }
  CHECK(!tree.nearest({50, 0, 0}, 10).found());
  CHECK(tree.nearest({50, 0, 0}, 60).found());
  CHECK(!SurfaceTree({}, {}).nearest({0, 0, 0}).found());
  CHECK_THROWS_AS(SurfaceTree(positions, std::vector<std::array<std::uint32_t, 4>>{{0, 1, 2, 60}}), Error);
  const std::vector<std::uint8_t> none(elements.size(), 0);
  CHECK(SurfaceTree(positions, elements, none).triangles() == 0);
}

TEST_CASE("the nearest place among the triangles that face a way, in either direction") {
  // A floor at z = 0 and a wall at x = 4, whose normal is -x.
  const std::vector<float> positions{0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 4, 0, 4, 4, 4, 4};
  const std::vector<std::array<std::uint32_t, 4>> elements{{0, 1, 2, 3}, {1, 4, 5, 2}};
  const SurfaceTree tree(positions, elements);
  const std::vector<std::array<double, 3>> up{{0, 0, 1}}, right{{1, 0, 0}}, along{{0, 1, 0}};
  constexpr double infinity = std::numeric_limits<double>::infinity();
  CHECK(tree.nearest({3, 2, 2}).element == 1);
  CHECK(tree.nearest({3, 2, 2}, infinity, {up, 0.5}).element == 0);
  CHECK(tree.nearest({3, 2, 2}, infinity, {up, 0.5}).distance == doctest::Approx(2));
  CHECK(tree.nearest({1, 2, 0.5}, infinity, {right, 0.5}).distance == doctest::Approx(3));
  CHECK(std::abs(tree.nearest({1, 2, 0.5}).normal[2]) == doctest::Approx(1));
  CHECK_FALSE(tree.nearest({3, 2, 2}, infinity, {along, 0.5}).found());
}

TEST_CASE("a search for a way that no triangle faces visits few of them") {
  Component floor;
  floor.add(100, [](double u, double v) { return Vec{100 * u, 100 * v, 0}; });
  const SurfaceTree tree(floor.positions, floor.elements);
  const std::vector<Vec> up{{0, 0, 1}}, along{{1, 0, 0}};
  constexpr double infinity = std::numeric_limits<double>::infinity();
  int found = 0;
  const auto seconds = [&](int searches, const std::vector<Vec>& way) {
    const std::clock_t begin = std::clock();
    for (int i = 0; i < searches; ++i)
      found += tree.nearest({i % 100 + 0.3, i % 71 + 0.4, 1}, infinity, {way, 0.5}).found() ? 1 : 0;
    return static_cast<double>(std::clock() - begin);
  };
  CHECK(seconds(50, along) < seconds(5000, up));  // visiting all 20,000 triangles takes ten times as long
  CHECK(found == 5000);
}
