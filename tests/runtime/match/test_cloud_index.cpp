#include "runtime/src/match/cloud_index.hpp"
#include "tests/runtime/match/brute_force.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace lbea;
using lbea::test::Position;

namespace {

std::vector<Point> as_points(std::span<const Position> positions) {
  std::vector<Point> points;
  for (const auto& [x, y, z] : positions) points.push_back({x, y, z});
  return points;
}

// Every query's answer equals brute force by distance. The search sums three squares in float: relative error below
// 4 eps; the differences before squaring are exact to eps of the coordinates.
void check_against_brute_force(std::span<const Position> cloud, std::span<const Position> queries, CloudIndex& index) {
  const PointTally tally = index.build(as_points(cloud), identity_transform);
  CHECK(tally.used == cloud.size());
  for (const Position& query : queries) {
    const NearestPoint found = index.nearest(query, {});
    if (cloud.empty()) {
      CHECK(found.point == NearestPoint::none);
      continue;
    }
    const auto expected = test::brute_force(cloud, query);
    REQUIRE(found.point < cloud.size());
    CHECK(std::sqrt(double{found.squared}) == doctest::Approx(std::sqrt(expected.squared)).epsilon(1e-6));
    const Position& p = cloud[found.point];
    CHECK(std::hypot(double{p[0]} - query[0], double{p[1]} - query[1], double{p[2]} - query[2]) <=
          std::sqrt(expected.squared) * (1 + 1e-6) + 1e-9);
  }
}

}  // namespace

TEST_CASE("nearest points equal brute force over sizes around the leaf, near and far") {
  for (const std::size_t size : {0u, 1u, 2u, 15u, 16u, 17u, 255u, 256u, 257u, 4'095u, 4'097u, 20'000u}) {
    CAPTURE(size);
    const auto cloud = test::random_positions(size, 100, static_cast<std::uint32_t>(size) + 1);
    auto queries = test::random_positions(60, 120, 2);
    const auto far = test::random_positions(20, 5'000, 3);
    queries.insert(queries.end(), far.begin(), far.end());
    for (const std::uint32_t cells : {1u, 64u, 100'000u}) {
      CloudIndex index(bounding_grid(cloud, cells), static_cast<std::uint32_t>(size));
      check_against_brute_force(cloud, queries, index);
    }
  }
}

TEST_CASE("a flat sheet, a line and a heap of equal points are clouds too") {
  auto sheet = test::random_positions(3'000, 200, 5);
  for (auto& p : sheet) p[2] = 7;
  auto line = sheet;
  for (auto& p : line) p[1] = -3;
  const std::vector<Position> heap(1'000, Position{1, 2, 3});
  const auto queries = test::random_positions(100, 300, 6);
  for (const auto& cloud : {sheet, line, heap}) {
    CloudIndex index(bounding_grid(cloud, 4'096), 3'000);
    check_against_brute_force(cloud, queries, index);
  }
}

TEST_CASE("equal distances go to the lower place in the frame") {
  // A lattice with every point twice, queried midway between lattice points: up to sixteen equals.
  std::vector<Position> lattice;
  for (int copy = 0; copy < 2; ++copy)
    for (int x = 7; x >= 0; --x)
      for (int y = 0; y < 8; ++y)
        for (int z = 7; z >= 0; --z)
          lattice.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  CloudIndex index(bounding_grid(lattice, 512), static_cast<std::uint32_t>(lattice.size()));
  index.build(as_points(lattice), identity_transform);
  for (float x = 0; x <= 7; x += 0.5f)
    for (float y = 0; y <= 7; y += 0.5f)
      for (float z = 0; z <= 7; z += 0.5f) {
        const Position query{x, y, z};
        CHECK(index.nearest(query, {}).point == test::brute_force(lattice, query).point);
      }
}

TEST_CASE("a bound prunes, but never an equally near point of lower place") {
  const auto cloud = test::random_positions(2'000, 50, 11);
  CloudIndex index(bounding_grid(cloud, 1'000), 2'000);
  index.build(as_points(cloud), identity_transform);
  for (const Position& query : test::random_positions(200, 60, 12)) {
    const NearestPoint exact = index.nearest(query, {});
    CHECK(index.nearest(query, {.squared = exact.squared}).point == exact.point);
    const float just_below = std::nextafter(exact.squared, 0.0f);
    CHECK(index.nearest(query, {.squared = just_below}).point == NearestPoint::none);
    NearestPoint rival = exact;  // the same distance under a higher number has to give way
    rival.point = exact.point + 1;
    CHECK(index.nearest(query, rival).point == exact.point);
  }
}

TEST_CASE("points are counted once: used, culled outside the grid, invalid when not finite") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<Position> corners{{0, 0, 0}, {10, 10, 10}};
  const std::vector<Point> points{{1, 1, 1},   {nan, 0, 0},  {0, inf, 0},   {5, 5, 5},
                                  {500, 5, 5}, {0, 0, -inf}, {5, -1e30f, 5}};
  CloudIndex index(bounding_grid(corners, 100), 16);
  const PointTally tally = index.build(points, identity_transform);
  CHECK(tally.received == 7);
  CHECK(tally.used == 2);
  CHECK(tally.invalid == 3);
  CHECK(tally.culled == 2);
  CHECK(index.nearest({5, 5, 6}, {}).point == 3);
}

TEST_CASE("an index forgets the frame before") {
  const auto large = test::random_positions(5'000, 100, 21), small = test::random_positions(18, 100, 22);
  CloudIndex index(bounding_grid(large, 4'096), 5'000);
  const auto queries = test::random_positions(50, 100, 23);
  check_against_brute_force(large, queries, index);
  check_against_brute_force(small, queries, index);
  check_against_brute_force({}, queries, index);
  check_against_brute_force(large, queries, index);
}

TEST_CASE("points are searched in reference coordinates") {
  // A quarter turn about z and a shift: the sensor's x axis is the reference's y axis.
  const RigidTransform T{0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30};
  const std::vector<Position> box{{-100, -100, -100}, {100, 100, 100}};
  CloudIndex index(bounding_grid(box, 64), 4);
  index.build(std::vector<Point>{{1, 2, 3}}, T);
  const NearestPoint found = index.nearest({8, 21, 33}, {});
  CHECK(found.point == 0);
  CHECK(found.squared == 0);
}

TEST_CASE("the envelope culls by its bits") {
  const std::vector<std::uint64_t> bits{0b1011};  // 2 x 2 x 1 cells, bit x + 2 y; (0, 1) is outside
  const EnvelopeView envelope{{0, 0, 0}, 1, {2, 2, 1}, bits};
  CloudIndex index(envelope_grid(envelope), 8);
  const std::vector<Point> points{
      {0.5f, 0.5f, 0.5f}, {1.5f, 0.5f, 0.5f}, {0.5f, 1.5f, 0.5f}, {1.5f, 1.5f, 0.5f}, {0.5f, 0.5f, 1.0f}};
  const PointTally tally = index.build(points, identity_transform);
  CHECK(tally.used == 3);
  CHECK(tally.culled == 2);
  CHECK(index.nearest({0.5f, 1.5f, 0.5f}, {}).point == 0);
}
