#include "adapters/clouds/point_cloud.hpp"
#include "tests/support/test_data.hpp"
#include "tools/bench/clouds.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::tool;
using namespace lbea::tool::bench;

namespace {

std::vector<Point> row(std::size_t count) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) points.push_back({static_cast<float>(i), 2, 3});
  return points;
}

}  // namespace

TEST_CASE("a thinned cloud has evenly spaced points of the cloud, in order") {
  const std::vector<Point> points = row(10);
  CHECK(resized(points, 1, 0).size() == 1);
  const std::vector<Point> five = resized(points, 5, 1);
  for (std::size_t i = 0; i < 5; ++i) CHECK(five[i].x == static_cast<float>(2 * i));
  const std::vector<Point> all = resized(points, 10, 1);
  for (std::size_t i = 0; i < 10; ++i) CHECK(all[i].x == points[i].x);
}

TEST_CASE("a repeated cloud begins with the cloud itself, and its repetitions differ by at most the jitter") {
  const std::vector<Point> points = row(10), more = resized(points, 1'000, 0.25f);
  REQUIRE(more.size() == 1'000);
  float least = 0, most = 0;
  for (std::size_t i = 0; i < more.size(); ++i) {
    const float moved = more[i].x - points[i % 10].x;
    if (i < 10) CHECK(moved == 0);
    least = std::min(least, moved);
    most = std::max(most, moved);
  }
  CHECK(least >= -0.2501f);
  CHECK(most <= 0.2501f);
  CHECK(least < -0.2f);
  CHECK(most > 0.2f);
  CHECK(resized(points, 1'000, 0.25f)[999].z == more[999].z);
}

TEST_CASE("folders are read by name, tables beside PLY clouds are ignored, clouds are thinned on request") {
  const test::TemporaryFolder folder;
  const std::vector<std::string> stamp{"stamp_ns 17"};
  write_ply(folder / "b.ply", row(4), {});
  write_ply(folder / "a.ply", row(9), stamp);
  std::ofstream(folder / "truth.csv") << "frame,stamp_ns\n0,17\n";
  const auto clouds = load_clouds({folder.path().string()}, {});
  REQUIRE(clouds.size() == 2);
  CHECK(clouds[0].name == "a.ply");
  CHECK(clouds[0].stamp_ns == 17);
  CHECK(clouds[0].points.size() == 9);
  CHECK(clouds[1].points.size() == 4);
  CHECK(most_points(clouds) == 9);
  CHECK(load_clouds({folder.path().string()}, 4)[0].points.size() == 4);
  std::ofstream(folder / "dic.csv") << "x,y,X,Y,Z,U,V,W\n1,2,30,40,50,0.5,0.25,0.125\n";
  const Point moved = load_clouds({(folder / "dic.csv").string()}, {}, "X+U,Y+V,Z+W").at(0).points.at(0);
  CHECK(std::vector{moved.x, moved.y, moved.z} == std::vector{30.5f, 40.25f, 50.125f});
  CHECK_THROWS_WITH_AS(static_cast<void>(load_clouds({folder.path().string()}, 5)),
                       doctest::Contains("b.ply: has 4 points"), Error);
}

TEST_CASE("missing paths, folders without clouds and clouds without points are refused") {
  const test::TemporaryFolder folder;
  CHECK_THROWS_WITH_AS(static_cast<void>(load_clouds({folder.path().string()}, {})),
                       doctest::Contains("no clouds in this folder"), Error);
  CHECK_THROWS_WITH_AS(static_cast<void>(load_clouds({(folder / "none.ply").string()}, {})),
                       doctest::Contains("no such file"), Error);
  write_ply(folder / "empty.ply", {}, {});
  CHECK_THROWS_WITH_AS(static_cast<void>(load_clouds({(folder / "empty.ply").string()}, {})),
                       doctest::Contains("has no points"), Error);
}
