#include "precompute/rig/counter_random.hpp"
#include "tests/rig/scenes.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <cstring>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr float plate_depth = 1000;

Scene plate() {
  Scene scene;
  scene.add_plate(-403, 403, -301, 301, plate_depth);
  return scene;
}

/// Along the line of sight, how far a point is from the plate it was measured on.
double residual(const Point& point) {
  const double length = std::hypot(point.x, point.y, point.z);
  return length * (1 - plate_depth / point.z);
}

double column_of(const Point& point) { return 100.0 * point.x / point.z + 60; }

bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0;
}

/// Five standard deviations of a binomial count.
double slack(double trials, double share) { return 5 * std::sqrt(trials * share * (1 - share)); }

}  // namespace

TEST_CASE("noise is along the line of sight, with mean 0 and the requested standard deviation") {
  const Scene scene = plate();
  SensingNoise noise = noiseless;
  noise.sigma = 0.5f;
  const auto points = look_at(scene, scaled(parallel_sensor(), 3)).sense({scene.positions}, noise, 7);
  const auto n = static_cast<double>(points.size());
  REQUIRE(n > 30000);
  double sum = 0, squares = 0, tails = 0;
  for (const Point& point : points) {
    const double r = residual(point);
    sum += r;
    squares += r * r;
    tails += std::abs(r) > 2 * noise.sigma ? 1 : 0;
    const double column = 3 * column_of(point);
    CHECK(std::abs(column - std::floor(column) - 0.5) < 1e-3);  // still on its pixel's line of sight
  }
  CHECK(std::abs(sum / n) < 5 * noise.sigma / std::sqrt(n));
  CHECK(std::abs(std::sqrt(squares / n) - noise.sigma) < 5 * noise.sigma / std::sqrt(2 * n));
  CHECK(std::abs(tails - 0.0455 * n) < slack(n, 0.0455));  // normal: 4.55 % beyond two sigma
}

TEST_CASE("clouds depend on the seed alone") {
  const Scene scene = plate();
  SensingNoise noise;
  noise.dropout = 0.1f;
  noise.background = 0.1f;
  const auto one = look_at(scene).sense({scene.positions}, noise, 5);
  CHECK(same(one, look_at(scene).sense({scene.positions}, noise, 5)));
  CHECK_FALSE(same(one, look_at(scene).sense({scene.positions}, noise, 6)));
  CHECK(frame_seed(1, 0) != frame_seed(1, 1));
  CHECK(frame_seed(1, 0) != frame_seed(2, 0));
}

TEST_CASE("dropouts, outliers and background have the requested shares") {
  const Scene scene = plate();
  const auto sensor = look_at(scene, scaled(parallel_sensor(), 3));
  const auto all = static_cast<double>(sensor.sense({scene.positions}, noiseless, 3).size());

  SensingNoise dropout = noiseless;
  dropout.dropout = 0.25f;
  const auto left = static_cast<double>(sensor.sense({scene.positions}, dropout, 3).size());
  CHECK(std::abs(left - 0.75 * all) < slack(all, 0.25));
  dropout.dropout = 1;
  CHECK(sensor.sense({scene.positions}, dropout, 3).empty());

  SensingNoise outliers = noiseless;
  outliers.outliers = 0.1f;
  double displaced = 0;
  for (const Point& point : sensor.sense({scene.positions}, outliers, 3)) {
    displaced += std::abs(residual(point)) > 0.01 ? 1 : 0;  // an outlier nearer than that: 1 in 3,000
    CHECK(std::abs(point.z / plate_depth - 1) <= 0.03001);
  }
  CHECK(std::abs(displaced - 0.1 * all) < slack(all, 0.1) + 0.1 * all / 3000);

  SensingNoise background = noiseless;
  background.background = 0.05f;
  double extra = 0;
  for (const Point& point : sensor.sense({scene.positions}, background, 3)) {
    if (point.z < 1100) continue;
    CHECK(point.z == doctest::Approx(1200));
    ++extra;
  }
  CHECK(extra > 0.02 * all);  // some of the wall is hidden from the right camera or outside its image
  CHECK(extra < 0.05 * all + slack(all, 0.05));
}

TEST_CASE("a frame of another resolution has the square of the factor as many points") {
  const Scene scene = plate();
  const auto once = look_at(scene).sense({scene.positions}, noiseless, 1).size();
  const auto twice = look_at(scene, scaled(parallel_sensor(), 2)).sense({scene.positions}, noiseless, 1).size();
  CHECK(std::abs(static_cast<double>(twice) - 4.0 * static_cast<double>(once)) < 0.05 * static_cast<double>(twice));
  CHECK(scaled(parallel_sensor(), 0.5).width_px == 60);
  CHECK(scaled(parallel_sensor(), 0.5).focal_px == 50);
}

TEST_CASE("invalid sensors and noise are refused with a sentence") {
  const Scene scene = plate();
  const auto sensor = look_at(scene);
  const auto status_of = [](const auto& call) {
    const Error error = error_of(call);
    if (error.status != Status::ok) CHECK(std::string_view(error.what()).size() > 20);
    return error.status;
  };
  SUBCASE("noise") {
    for (float SensingNoise::*member : {&SensingNoise::sigma, &SensingNoise::outliers, &SensingNoise::dropout,
                                        &SensingNoise::background, &SensingNoise::min_cos_incidence})
      for (const float value : {-0.1f, std::nanf(""), INFINITY}) {
        SensingNoise noise;
        noise.*member = value;
        CHECK(status_of([&] { (void)sensor.sense({scene.positions}, noise, 1); }) == Status::bad_config);
      }
  }
  SUBCASE("a state of another size") {
    const std::vector<float> few(9), odd(13);
    const std::vector<std::uint8_t> flags(2, 1);
    CHECK(status_of([&] { (void)sensor.image({few}); }) == Status::bad_input);
    CHECK(status_of([&] { (void)sensor.image({odd}); }) == Status::bad_input);
    CHECK(status_of([&] { (void)sensor.image({scene.positions, flags}); }) == Status::bad_input);
  }
  SUBCASE("an element beyond the nodes") {
    CHECK(status_of([&] { VirtualSensor(parallel_sensor(), 3, scene.elements); }) == Status::bad_input);
  }
  SUBCASE("a sensor that is none") {
    const auto with = [&](const auto& change) {
      StereoSensor broken = parallel_sensor();
      change(broken);
      return status_of([&] { VirtualSensor(broken, scene.nodes(), scene.elements); });
    };
    CHECK(with([](StereoSensor&) {}) == Status::ok);
    CHECK(with([](StereoSensor& s) { s.width_px = 0; }) == Status::bad_config);
    CHECK(with([](StereoSensor& s) { s.width_px = s.height_px = 0xffffffff; }) == Status::bad_config);
    CHECK(with([](StereoSensor& s) { s.focal_px = 0; }) == Status::bad_config);
    CHECK(with([](StereoSensor& s) { s.focal_px = std::nanf(""); }) == Status::bad_config);
    CHECK(with([](StereoSensor& s) { s.T_reference_right[0] = 2; }) == Status::bad_config);
    CHECK(with([](StereoSensor& s) { s.T_reference_sensor[0] = -1; }) == Status::bad_config);  // a mirror
    CHECK(with([](StereoSensor& s) { s.T_reference_sensor[3] = INFINITY; }) == Status::bad_config);
  }
  SUBCASE("a scale that makes no image") {
    for (const double factor : {0.0, -1.0, 1e-6, 1e12, std::nan("")})
      CHECK(status_of([&] { (void)scaled(parallel_sensor(), factor); }) == Status::bad_config);
  }
}
