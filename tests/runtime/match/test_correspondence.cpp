#include "runtime/src/match/correspondence.hpp"
#include "tests/runtime/match/brute_force.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using lbea::test::Position;

TEST_CASE("every vertex gets its nearest point, whatever the order of the vertices") {
  const auto cloud = test::random_positions(3'000, 100, 1);
  std::vector<Point> points;
  for (const auto& [x, y, z] : cloud) points.push_back({x, y, z});
  CloudIndex index(bounding_grid(cloud, 2'048), 3'000);
  index.build(points, identity_transform);
  for (const std::size_t n : {1u, 2u, 16u, 17u, 500u}) {
    const auto vertices = test::random_positions(n, 130, 2);
    Positions corresponding(n);
    std::vector<std::uint32_t> places(n);
    correspond(index, vertices, corresponding, places);
    for (std::size_t v = 0; v < n; ++v) {
      CHECK(places[v] == test::brute_force(cloud, vertices[v]).point);
      CHECK(corresponding[v] == cloud[places[v]]);
    }
  }
}

TEST_CASE("several vertices may share a point") {
  const std::vector<Point> one{{1, 2, 3}};
  const std::vector<Position> box{{-10, -10, -10}, {10, 10, 10}};
  CloudIndex index(bounding_grid(box, 8), 1);
  index.build(one, identity_transform);
  const auto vertices = test::random_positions(40, 10, 3);
  Positions corresponding(vertices.size());
  correspond(index, vertices, corresponding);
  for (std::size_t v = 0; v < vertices.size(); ++v) CHECK(corresponding[v] == Position{1, 2, 3});
}

// A ring about a row of vertices took up to five times as long as an ordinary cloud: each vertex tested every point.
TEST_CASE("the search for many vertices with equally distant points is limited, and says for how many it was cut") {
  constexpr std::size_t size = 20'000;
  const auto random = test::random_positions(size, 1, 7);
  std::vector<Position> ring, row;
  for (const auto& [angle, y, z] : random) ring.push_back({0, std::cos(3.2f * angle), std::sin(3.2f * angle)});
  for (int v = 0; v < 320; ++v) row.push_back({static_cast<float>(v) - 160, 0, 0});
  std::vector<Point> points;
  for (const auto& [x, y, z] : ring) points.push_back({x, y, z});
  CloudIndex index(bounding_grid(test::random_positions(100, 200, 8), 4'096), size);
  index.build(points, identity_transform);

  Positions exact(row.size()), limited(row.size());
  CHECK(correspond(index, row, exact) == 0);
  const std::uint32_t cut = correspond(index, row, limited, {}, most_hard_tests(index, row.size()));
  CHECK(cut > 0);
  std::size_t different = 0;
  for (std::size_t v = 0; v < row.size(); ++v) {
    different += exact[v] != limited[v];
    // Any point of this ring is the nearest one up to the rounding of squared distances.
    const auto distance = [&](const Position& p) { return std::hypot(p[0] - row[v][0], p[1], p[2]); };
    CHECK(distance(limited[v]) == doctest::Approx(distance(exact[v])).epsilon(1e-6));
  }
  CHECK(different <= cut);
}

TEST_CASE("the guess never changes the result, not even where searches are cut") {
  constexpr std::size_t size = 20'000;
  const auto guesses = test::random_positions(320, 150, 9);
  for (const float spread : {0.0f, 0.1f, 60.0f}) {  // a ring, a thick one, a cloud that is not crowded
    std::vector<Point> points;
    for (const auto& [angle, y, z] : test::random_positions(size, 1, 10))
      points.push_back({spread * angle, std::cos(3.2f * angle) + spread * y, std::sin(3.2f * angle) + spread * z});
    CloudIndex index(bounding_grid(test::random_positions(100, 200, 8), 4'096), size);
    index.build(points, identity_transform);
    CHECK(index.is_crowded() == (spread < 1));
    std::vector<Position> row;
    for (int v = 0; v < 320; ++v) row.push_back({0.1f * static_cast<float>(v) - 16, 0, 0});
    Positions first(row.size()), second(row.size());
    for (std::size_t v = 0; v < row.size(); ++v) second.set(v, guesses[v]);
    const std::uint32_t limit = most_hard_tests(index, row.size());
    CHECK(correspond(index, row, first, {}, limit) == correspond(index, row, second, {}, limit));
    CHECK(first.planes == second.planes);
  }
}

namespace {

float coverage(const CloudIndex& index, std::span<const Position> surface, const std::vector<double>& mass,
               float distance) {
  std::vector<std::uint8_t> is_shown(surface.size());
  find_shown(index, surface, distance, is_shown);
  return share_shown(is_shown, mass);
}

}  // namespace

TEST_CASE("coverage is the seen share of the mass") {
  const std::vector<Position> surface{{0, 0, 0}, {10, 0, 0}, {20, 0, 0}};
  const std::vector<double> mass{1, 2, 5};
  const std::vector<Position> box{{-10, -10, -10}, {30, 10, 10}};
  CloudIndex index(bounding_grid(box, 8), 4);
  index.build(std::vector<Point>{{0, 1, 0}, {10, 0, 2.5f}}, identity_transform);
  CHECK(coverage(index, surface, mass, 0.5f) == 0.0f);
  CHECK(coverage(index, surface, mass, 1.0f) == doctest::Approx(1.0 / 8));
  CHECK(coverage(index, surface, mass, 2.5f) == doctest::Approx(3.0 / 8));
  CHECK(coverage(index, surface, mass, 11.0f) == doctest::Approx(1.0));
}

TEST_CASE("coverage counts exactly the vertices that brute force finds near a point, over sizes around the group") {
  for (const std::size_t points : {1u, 17u, 3'000u}) {
    const auto cloud = test::random_positions(points, 60, 41);
    std::vector<Point> frame;
    for (const auto& [x, y, z] : cloud) frame.push_back({x, y, z});
    CloudIndex index(bounding_grid(test::random_positions(100, 90, 43), 512), 4'096);
    index.build(frame, identity_transform);
    for (const std::size_t n : {1u, 2u, 15u, 16u, 17u, 33u, 500u}) {
      const auto surface = test::random_positions(n, 120, 42);  // some of it where there are no cells
      for (const float distance : {2.0f, 10.0f, 100.0f}) {
        const auto near = std::ranges::count_if(surface, [&](const Position& vertex) {
          return std::sqrt(test::brute_force(cloud, vertex).squared) <= double{distance};
        });
        CHECK(coverage(index, surface, std::vector<double>(n, 1.0), distance) ==
              doctest::Approx(static_cast<double>(near) / static_cast<double>(n)));
      }
    }
  }
}
