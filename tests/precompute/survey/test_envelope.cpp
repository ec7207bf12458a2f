#include "precompute/survey/envelope.hpp"

#include "runtime/src/match/cloud_index.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;
using namespace lbea::bake;

namespace {

struct Sheet {
  std::vector<float> positions;
  std::vector<Quad> elements;
  std::array<float, 3> min{}, max{};
};

Sheet random_sheet(std::mt19937& random, int quads, float extent, float edge) {
  std::uniform_real_distribution<float> anywhere(-extent, extent), near(-edge, edge);
  Sheet sheet;
  sheet.min.fill(INFINITY);
  sheet.max.fill(-INFINITY);
  for (int q = 0; q < quads; ++q) {
    const std::array<float, 3> centre{anywhere(random), anywhere(random), anywhere(random) / 4};
    const auto first = static_cast<std::uint32_t>(sheet.positions.size() / 3);
    for (int corner = 0; corner < 4; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float x = centre[axis] + near(random);
        sheet.positions.push_back(x);
        sheet.min[axis] = std::min(sheet.min[axis], x);
        sheet.max[axis] = std::max(sheet.max[axis], x);
      }
    sheet.elements.push_back({first, first + 1, first + 2, q % 3 == 0 ? first + 2 : first + 3});
  }
  return sheet;
}

EnvelopeGrid envelope_of(const Sheet& sheet, double margin) {
  EnvelopeBuilder builder(sheet.min, sheet.max, margin);
  builder.add(sheet.positions, sheet.elements);
  return builder.finish();
}

/// A random point of a random element: of the triangle 0-1-2 or 0-2-3.
std::array<double, 3> point_on(const Sheet& sheet, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  const Quad& q = sheet.elements[std::uniform_int_distribution<std::size_t>(0, sheet.elements.size() - 1)(random)];
  double u = share(random), v = share(random);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const std::size_t second = share(random) < 0.5 ? 1 : 2, third = second + 1;
  std::array<double, 3> point{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = [&](std::size_t corner) {
      return static_cast<double>(sheet.positions[3 * std::size_t{q[corner]} + axis]);
    };
    point[axis] = at(0) + u * (at(second) - at(0)) + v * (at(third) - at(0));
  }
  return point;
}

/// How many points the runtime takes for background, in its own arithmetic.
std::uint32_t culled(const EnvelopeGrid& grid, const std::vector<Point>& points) {
  CloudIndex index(envelope_grid({grid.corner, grid.edge, grid.cells, grid.bits}),
                   static_cast<std::uint32_t>(points.size()));
  return index.build(points, identity_transform).culled;
}

}  // namespace

TEST_CASE("no point within the margin of a surface is ever outside") {
  std::mt19937 random(1);
  std::normal_distribution<double> direction;
  for (const auto& [extent, edge, margin] :
       {std::tuple{200.f, 4.f, 25.}, {200.f, 150.f, 25.}, {10.f, 1.f, 25.}, {3000.f, 40.f, 5.}}) {
    const Sheet sheet = random_sheet(random, 40, extent, edge);
    const EnvelopeGrid grid = envelope_of(sheet, margin);
    std::vector<Point> points;
    for (int i = 0; i < 5000; ++i) {
      auto point = point_on(sheet, random);
      std::array<double, 3> step{direction(random), direction(random), direction(random)};
      const double length = std::hypot(step[0], step[1], step[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) point[axis] += step[axis] / length * margin * 0.99999;
      const std::array<float, 3> at{static_cast<float>(point[0]), static_cast<float>(point[1]),
                                    static_cast<float>(point[2])};
      REQUIRE(grid.contains(at));
      points.push_back({at[0], at[1], at[2]});
    }
    CHECK(culled(grid, points) == 0);
  }
}

TEST_CASE("a point far from all elements' boxes is outside") {
  std::mt19937 random(2);
  const double margin = 10;
  const Sheet sheet = random_sheet(random, 10, 200, 5);
  const EnvelopeGrid grid = envelope_of(sheet, margin);
  const double reach = margin + 3.1 * std::sqrt(3.0) * static_cast<double>(grid.edge);
  std::uniform_real_distribution<float> anywhere(-260, 260);
  int far = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::array<float, 3> at{anywhere(random), anywhere(random), anywhere(random) / 3};
    const bool is_far = std::ranges::all_of(sheet.elements, [&](const Quad& q) {
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [low, high] =
            std::ranges::minmax(q, {}, [&](std::uint32_t v) { return sheet.positions[3 * std::size_t{v} + axis]; });
        const double inside =
            std::clamp(static_cast<double>(at[axis]), static_cast<double>(sheet.positions[3 * std::size_t{low} + axis]),
                       static_cast<double>(sheet.positions[3 * std::size_t{high} + axis]));
        squared += (static_cast<double>(at[axis]) - inside) * (static_cast<double>(at[axis]) - inside);
      }
      return squared > reach * reach;
    });
    if (!is_far) continue;
    ++far;
    CHECK_FALSE(grid.contains(at));
  }
  CHECK(far > 1000);
}

TEST_CASE("the grid stays small and covers samples added one by one in any order") {
  std::mt19937 random(3);
  const Sheet sheet = random_sheet(random, 60, 500, 20);
  EnvelopeBuilder forward(sheet.min, sheet.max, 25), backward(sheet.min, sheet.max, 25);
  for (std::size_t i = 0; i < sheet.elements.size(); ++i) {
    forward.add(sheet.positions, std::span(sheet.elements).subspan(i, 1));
    backward.add(sheet.positions, std::span(sheet.elements).subspan(sheet.elements.size() - 1 - i, 1));
  }
  const EnvelopeGrid grid = forward.finish();
  CHECK(grid.bits == backward.finish().bits);
  CHECK(grid.bits == envelope_of(sheet, 25).bits);
  CHECK(grid.count() < 1.3 * (1 << 17));
  CHECK(grid.bits.size() == (grid.count() + 63) / 64);
}

TEST_CASE("a flat sample has an envelope") {
  const std::array<float, 3> min{0, 0, 0}, max{100, 50, 0};
  EnvelopeBuilder builder(min, max, 25);
  CHECK(builder.layout().edge == doctest::Approx(6.25));
  builder.add(std::vector<float>{0, 0, 0, 100, 0, 0, 100, 50, 0, 0, 50, 0}, std::vector<Quad>{{0, 1, 2, 3}});
  const EnvelopeGrid grid = builder.finish();
  CHECK(grid.contains({50, 25, 24.9f}));
  CHECK(grid.contains({-24.9f, 0, 0}));
  CHECK_FALSE(grid.contains({50, 25, 60}));
  CHECK_FALSE(grid.contains({NAN, 25, 0}));
}

TEST_CASE("a large slanting element does not fill its box") {
  const std::array<float, 3> min{0, 0, 0}, max{200, 200, 10};
  EnvelopeBuilder builder(min, max, 10);
  builder.add(std::vector<float>{0, 0, 0, 200, 200, 0, 200, 200, 10, 0, 0, 10}, std::vector<Quad>{{0, 1, 2, 3}});
  const EnvelopeGrid grid = builder.finish();
  const double reach = 10 + 3.1 * std::sqrt(3.0) * static_cast<double>(grid.edge);
  for (float x = 0; x <= 200; x += 5)
    for (float y = 0; y <= 200; y += 5) {
      const double distance = std::abs(static_cast<double>(x - y)) / std::sqrt(2.0);
      if (distance < 9.99) CHECK(grid.contains({x, y, 5}));
      if (distance > reach) CHECK_FALSE(grid.contains({x, y, 5}));
    }
}

TEST_CASE("the cells of flat and very long boxes are few, and their elements cost little") {
  const std::array<float, 3> min{0, 0, 0};
  for (const auto& box : {std::pair{std::array<float, 3>{100, 100, 0}, 1e-6},
                          {std::array<float, 3>{1e6f, 100, 50}, 25.},
                          {std::array<float, 3>{1e12f, 0, 0}, 25.},
                          {std::array<float, 3>{1e30f, 100, 50}, 25.}}) {
    const auto& max = box.first;
    CAPTURE(max[0]);
    EnvelopeBuilder builder(min, max, box.second);
    CHECK(builder.layout().count() < 2 * (1 << 17));
    std::vector<float> slivers;
    std::vector<Quad> elements;
    for (std::uint32_t i = 0; i < 7; ++i) {
      const float y = max[1] * static_cast<float>(i) / 7, z = max[2] * static_cast<float>(i) / 7;
      slivers.insert(slivers.end(), {0, y, z, max[0], y, z, max[0] / 2, y, z});
      elements.push_back({3 * i, 3 * i + 1, 3 * i + 2, 3 * i + 2});
    }
    builder.add(slivers, elements);  // splitting by four took the square of the length in cells: hours
    const EnvelopeGrid grid = builder.finish();
    for (const float share : {0.f, 0.3f, 0.999f}) CHECK(grid.contains({share * max[0], 0, 0}));
  }
}

TEST_CASE("an invalid margin is refused") {
  const std::array<float, 3> min{0, 0, 0}, max{1, 1, 1}, nowhere{INFINITY, 1, 1};
  CHECK_THROWS_WITH_AS(EnvelopeBuilder(min, max, 0), doctest::Contains("margin must be positive"), Error);
  CHECK_THROWS_AS(EnvelopeBuilder(min, max, -5), Error);
  CHECK_THROWS_AS(EnvelopeBuilder(min, max, NAN), Error);
  CHECK_THROWS_AS(EnvelopeBuilder(min, nowhere, 1), Error);
}
