#include "tests/rig/scenes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {
std::size_t measured_pixels(const SensorImage& image) {
  return static_cast<std::size_t>(std::count(image.measured.begin(), image.measured.end(), 1));
}
}  // namespace

TEST_CASE("a plate across the axis is measured in every pixel that falls on it, at its depth") {
  Scene scene;
  scene.add_plate(-301, 433, -207, 99, 1000);
  const auto sensor = look_at(scene);
  const auto points = sensor.sense({scene.positions}, noiseless, 1);
  // The right image ends at u = 0, which is u = focal * baseline / depth = 20 px in the left one: x = -400.
  CHECK(points.size() == pixels_between(-301, 433, 1000, 120, 100) * pixels_between(-207, 99, 1000, 80, 100));
  for (const Point& point : points) {
    CHECK(point.z == doctest::Approx(1000).epsilon(1e-6));
    CHECK((point.x >= -301.001f && point.x <= 433.001f && point.y >= -207.001f && point.y <= 99.001f));
  }
}

TEST_CASE("only what lies in the right image too is measured") {
  Scene scene;
  scene.add_plate(-2000, 2000, -2000, 2000, 1000);
  const auto image = look_at(scene).image({scene.positions});
  for (std::uint32_t row = 0; row < 80; ++row)
    for (std::uint32_t column = 0; column < 120; ++column)
      CHECK(image.measured[row * 120 + column] == (column + 0.5 - 20 >= 0 ? 1 : 0));
  CHECK(std::none_of(image.depth.begin(), image.depth.end(), [](float depth) { return std::isnan(depth); }));
}

TEST_CASE("a plate that hides part of another from the right camera alone removes exactly that part") {
  Scene scene;
  scene.add_plate(-403, 403, -301, 301, 1000);
  const float near = 500, from = 51, to = 101;  // seen by the left camera at x = 102 .. 202 on the far plate
  scene.add_plate(from, to, -301, 301, near);
  const auto image = look_at(scene).image({scene.positions});
  std::size_t hidden = 0;
  for (std::uint32_t column = 0; column < 120; ++column) {
    const std::size_t pixel = 40 * 120 + column;
    const double x = (column + 0.5 - 60) / 100 * 1000;                // on the far plate
    const double crossing = baseline + (x - baseline) * near / 1000;  // of the right camera's line of sight, at `near`
    if (image.element[pixel] != 0) continue;
    const bool free = crossing < from || crossing > to;
    CHECK(image.measured[pixel] == (free ? 1 : 0));
    hidden += free ? 0 : 1;
  }
  CHECK(hidden == 10);  // 50 wide at half the distance is 100 wide behind: 10 pixels of 10
}

TEST_CASE("the incidence limit holds in both cameras") {
  Scene scene;  // a plane through (0, 0, 1000) turned about the vertical axis
  const float tilt = 1.2f, reach = 500;
  const float dx = reach * std::cos(tilt), dz = reach * std::sin(tilt);
  scene.add({{{-dx, -300, 1000 - dz}, {dx, -300, 1000 + dz}, {dx, 300, 1000 + dz}, {-dx, 300, 1000 - dz}}});
  const auto sensor = look_at(scene);
  const double nx = std::sin(tilt), nz = -std::cos(tilt);
  for (const float limit : {0.0f, 0.3f, 0.45f, 0.99f}) {
    const auto image = sensor.image({scene.positions}, limit);
    for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
      if (image.element[pixel] == no_element) continue;
      const double z = image.depth[pixel];
      const double x = (static_cast<double>(pixel % 120) + 0.5 - 60) / 100 * z;
      const double y = (static_cast<double>(pixel / 120) + 0.5 - 40) / 100 * z;
      const double left = (nx * x + nz * z) / std::hypot(x, y, z);
      const double right = (nx * (x - baseline) + nz * z) / std::hypot(x - baseline, y, z);
      const double least = left * right > 0 ? std::min(std::abs(left), std::abs(right)) : 0;
      if (std::abs(least - limit) < 1e-4 || 100 * (x - baseline) / z < -59.9) continue;
      CHECK(image.measured[pixel] == (least > limit ? 1 : 0));
    }
    if (limit == 0.99f) CHECK(measured_pixels(image) == 0);
    if (limit == 0.3f) CHECK(measured_pixels(image) > 100);
  }
}

TEST_CASE("a warped quad is split along nodes 0-2") {
  Scene scene;
  scene.add({{{-100, -100, 900}, {100, -100, 1100}, {100, 100, 900}, {-100, 100, 1100}}});
  StereoSensor odd = parallel_sensor();
  odd.width_px = odd.height_px = 81;  // one pixel lies on the axis
  const auto depth = look_at(scene, odd).depth_image({scene.positions});
  CHECK(depth[40 * 81 + 40] == doctest::Approx(900).epsilon(1e-6));  // along 1-3 it would be 1100
}

TEST_CASE("no ray passes between the elements of a surface, also when it meets their nodes and edges") {
  // Nodes at pixel centres and between them, at depths that are no round numbers.
  Scene scene;
  constexpr std::uint32_t side = 41;
  const StereoSensor sensor = parallel_sensor();
  for (std::uint32_t row = 0; row < side; ++row)
    for (std::uint32_t column = 0; column < side; ++column) {
      const double depth = 1000.1 + 7.3 * (column % 3) + 3.7 * (row % 5);
      const double x = (-10 + 0.5 * column + 0.5) / 100, y = (-10 + 0.5 * row + 0.5) / 100;
      for (const double value : {x * depth, y * depth, depth}) scene.positions.push_back(static_cast<float>(value));
    }
  for (std::uint32_t row = 0; row + 1 < side; ++row)
    for (std::uint32_t column = 0; column + 1 < side; ++column) {
      const std::uint32_t first = row * side + column;
      scene.elements.push_back({first, first + 1, first + side + 1, first + side});
    }
  const SensorImage image = look_at(scene).image({scene.positions}, 0);
  for (std::uint32_t row = 31; row < 50; ++row)
    for (std::uint32_t column = 51; column < 70; ++column)
      CHECK(std::isfinite(image.depth[std::size_t{row} * sensor.width_px + column]));
}

TEST_CASE("a triangle repeats its last node and is whole") {
  Scene scene;
  scene.add_plate(-101, 101, -101, 101, 1000);
  scene.elements[0][3] = scene.elements[0][2];
  const auto image = look_at(scene).image({scene.positions});
  // the half above the diagonal from (-101, -101) to (101, 101); pixel centres of the diagonal itself count, or not
  const std::size_t side = pixels_between(-101, 101, 1000, 120, 100), seen = measured_pixels(image);
  CHECK((seen >= side * (side - 1) / 2 && seen <= side * (side + 1) / 2));
}

TEST_CASE("eroded elements do not hide what is behind them") {
  Scene scene;
  scene.add_plate(-403, 403, -301, 301, 1000);
  scene.add_plate(-403, 403, -301, 301, 800);
  const auto sensor = look_at(scene);
  const std::vector<std::uint8_t> all{1, 1}, far_only{1, 0}, none{0, 0};
  const std::size_t middle = 40 * 120 + 60;
  CHECK(sensor.image({scene.positions, all}).depth[middle] == doctest::Approx(800));
  CHECK(sensor.image({scene.positions, far_only}).depth[middle] == doctest::Approx(1000));
  CHECK(sensor.image({scene.positions, far_only}).element[middle] == 0);
  CHECK(std::isnan(sensor.image({scene.positions, none}).depth[middle]));
  CHECK(sensor.sense({scene.positions, none}, SensingNoise{}, 1).empty());
  CHECK(sensor.visible_elements({scene.positions, all}) == std::vector<std::uint8_t>{0, 1});
  CHECK(sensor.visible_elements({scene.positions, far_only}) == std::vector<std::uint8_t>{1, 0});
}

TEST_CASE("no mesh, a mesh behind the cameras, a mesh beside the image: no points") {
  SensingNoise noise;
  noise.background = 1;
  const Scene empty;
  CHECK(look_at(empty).sense({empty.positions}, noise, 1).empty());
  Scene behind;
  behind.add_plate(-403, 403, -301, 301, -1000);
  CHECK(look_at(behind).sense({behind.positions}, noise, 1).empty());
  CHECK(look_at(behind).visible_nodes({behind.positions}) == std::vector<std::uint8_t>(4, 0));
  Scene beside;
  beside.add_plate(2000, 2403, -301, 301, 1000);
  CHECK(look_at(beside).sense({beside.positions}, noise, 1).empty());
}

TEST_CASE("an element with a position that is not finite is not seen, its neighbours are") {
  Scene scene;
  scene.add_plate(-403, -1, -301, 301, 1000);
  scene.add_plate(1, 403, -301, 301, 1000);
  const auto sensor = look_at(scene);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    auto positions = scene.positions;
    for (std::size_t corner : {0u, 1u, 2u}) positions[3 * corner + 2] = bad;
    CHECK(sensor.visible_elements({positions}) == std::vector<std::uint8_t>{0, 1});
    CHECK(sensor.visible_nodes({positions})[0] == 0);
    CHECK(sensor.visible_nodes({positions})[4] == 1);
  }
}

TEST_CASE("nodes are visible when nothing hides them from either camera") {
  Scene scene;
  scene.add_plate(-303, 303, -201, 201, 1000);
  CHECK(look_at(scene).visible_nodes({scene.positions}) == std::vector<std::uint8_t>{1, 1, 1, 1});
  scene.add_plate(120, 180, -150, 150, 500);  // hides x = 240 .. 360 from the left, 40 .. 160 from the right
  CHECK(look_at(scene).visible_nodes({scene.positions}) == std::vector<std::uint8_t>{1, 0, 0, 1, 1, 1, 1, 1});
  scene.positions[0] = scene.positions[9] = -550;  // still in the left image, no longer in the right one
  CHECK(look_at(scene).visible_nodes({scene.positions}) == std::vector<std::uint8_t>{0, 0, 0, 0, 1, 1, 1, 1});
}

TEST_CASE("the pose only moves the coordinates: the same cloud in sensor coordinates") {
  Scene scene;
  scene.add_plate(-303, 303, -201, 201, 1000);
  const auto plain = look_at(scene).sense({scene.positions}, noiseless, 1);
  StereoSensor turned = parallel_sensor();  // reference x = sensor z, y = sensor x, z = sensor y, shifted
  turned.T_reference_sensor = {0, 0, 1, 10, 1, 0, 0, 20, 0, 1, 0, 30};
  turned.T_reference_right = {0, 0, 1, 10, 1, 0, 0, 20 + baseline, 0, 1, 0, 30};
  Scene moved = scene;
  for (std::size_t i = 0; i < moved.positions.size(); i += 3) {
    const float* from = &scene.positions[i];
    float* to = &moved.positions[i];
    to[0] = from[2] + 10, to[1] = from[0] + 20, to[2] = from[1] + 30;
  }
  const auto points = look_at(moved, turned).sense({moved.positions}, noiseless, 1);
  REQUIRE(points.size() == plain.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(points[i].x == doctest::Approx(plain[i].x).epsilon(1e-5));
    CHECK(points[i].z == doctest::Approx(plain[i].z).epsilon(1e-5));
  }
}
