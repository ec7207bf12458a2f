// Disturbed frames of the evaluation, by their definitions.
#include "tools/eval/evaluation.hpp"
#include "tools/eval/experiments.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

std::vector<Point> random_points(std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 100);
  std::vector<Point> points(count);
  for (Point& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return points;
}

}  // namespace

TEST_CASE("points are hidden in patches until the share is removed; the others are unchanged") {
  const auto points = random_points(5000);
  const auto rest = hide_patches(points, 0.3, 20, 7);
  CHECK(rest.size() == 3500);
  std::size_t at = 0;
  for (const Point& p : rest) {
    while (at < points.size() && (points[at].x != p.x || points[at].y != p.y || points[at].z != p.z)) ++at;
    REQUIRE(at < points.size());
  }
  CHECK(hide_patches(points, 0, 20, 7).size() == 5000);
  CHECK(hide_patches(points, 1, 20, 7).empty());
  CHECK(hide_patches({}, 0.3, 20, 7).empty());
  const auto again = hide_patches(points, 0.3, 20, 7);
  CHECK(std::ranges::equal(again, rest,
                           [](const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }));
}

TEST_CASE("a connected patch hides the points that are nearest to its place") {
  const auto points = random_points(5000);
  const auto rest = hide_nearest(points, 0.3, {10, 20, 30});
  CHECK(rest.size() == 3500);
  const auto distance = [](const Point& p) { return std::hypot(p.x - 10, p.y - 20, p.z - 30); };
  const float nearest = distance(*std::ranges::min_element(rest, {}, distance));
  CHECK(std::ranges::count_if(points, [&](const Point& p) { return distance(p) < nearest; }) == 1500);
  const Disturbance connected{.connected = 0.3};
  CHECK(disturbed(points, connected, 7, Point{10, 20, 30}).size() == 3500);
  CHECK(disturbed(points, connected, 7).size() == 3500);
  CHECK(disturbed({}, connected, 7).empty());
}

TEST_CASE("windows of stereo matching smear depth steps and lose edges") {
  bake::StereoSensor sensor;
  sensor.focal_px = 100, sensor.width_px = 60, sensor.height_px = 40;
  std::vector<Point> points;  // pixels 10 to 49 of all rows; a step of 100 behind column 30
  for (int row = 0; row < 40; ++row)
    for (int column = 10; column < 50; ++column) {
      const float z = column < 30 ? 500.0f : 600.0f, f = 100;
      points.push_back({(static_cast<float>(column) - 29.5f) / f * z, (static_cast<float>(row) - 19.5f) / f * z, z});
    }
  std::size_t in_middle = 0;
  for (const Point& p : smeared(points, sensor, 5)) {
    const auto column = static_cast<int>(std::floor(100 * p.x / p.z + 30)),
               row = static_cast<int>(std::floor(100 * p.y / p.z + 20));
    if (row != 20) continue;
    ++in_middle;
    CHECK(column >= 11);  // a window with its middle at 10 has three of its five columns
    CHECK(column <= 48);
    const int behind = std::clamp(column + 3 - 30, 0, 5);  // columns of the window
    CHECK(p.z == doctest::Approx(500 + 20 * behind));
  }
  CHECK(in_middle == 38);
  CHECK(smeared({}, sensor, 5).empty());
}

TEST_CASE("thinning keeps a random share") {
  const auto points = random_points(9000);
  // Binomial with p = 1/3: standard deviation 45.
  CHECK(std::abs(static_cast<double>(thin(points, 1.0 / 3, 3).size()) - 3000) < 5 * 45);
  CHECK(thin(points, 1, 3).size() == 9000);
  CHECK(thin(points, 0, 3).empty());
}

TEST_CASE("a pose error turns about the center by the given angle and shifts by the given length") {
  const RigidTransform T{0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30};  // reference x = 10 - y, y = 20 + x
  const Point center{50, 60, 70}, at_center{40, -40, 40};
  const Disturbance error{.pose_error_deg = 3, .pose_error = 5};
  const auto distance = [](const Point& a, const Point& b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); };
  const std::vector<Point> before{at_center, {140, -40, 40}, {40, 60, 40}, {40, -40, 140}};
  for (const double share : {0.5, 1.0}) {
    const auto after = misplaced(before, error, share, T, center, 9);
    CHECK(distance(after[0], at_center) == doctest::Approx(5 * share).epsilon(1e-4));
    // The trace of the rotation, from the images of the axes, is 1 + 2 cos(angle).
    const float trace = (after[1].x - after[0].x + after[2].y - after[0].y + after[3].z - after[0].z) / 100;
    CHECK(std::acos((trace - 1) / 2) * 57.29578f == doctest::Approx(3 * share).epsilon(2e-3));
    const PoseError left = left_over(identity_transform, error, share, center, 9);
    CHECK(left.turn_deg == doctest::Approx(3 * share));
    CHECK(left.shift == doctest::Approx(5 * share));
  }
}
