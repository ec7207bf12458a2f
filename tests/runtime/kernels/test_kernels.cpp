// One build carries its inner loops for several instruction sets: each must answer with the same bits.
#include "runtime/src/match/cloud_index.hpp"
#include "tests/runtime/match/brute_force.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace lbea;
using lbea::test::Position;

namespace {

std::vector<const Kernels*> all_kernels() {
  std::vector<const Kernels*> found;
  for (const Kernels* const* k = available_kernels(); *k != nullptr; ++k) found.push_back(*k);
  return found;
}

bool same_bits(const NearestPoint& a, const NearestPoint& b) {
  return a.point == b.point && std::memcmp(&a.squared, &b.squared, sizeof(float)) == 0 && a.x == b.x && a.y == b.y &&
         a.z == b.z;
}

}  // namespace

TEST_CASE("the best available kernels are the ones in use, and the baseline is always there") {
  const auto found = all_kernels();
  REQUIRE_FALSE(found.empty());
  CHECK(&kernels() == found.front());
  CHECK(std::string(found.back()->name) == "kernels_baseline");
}

TEST_CASE("indexes built and searched by any kernels give the same bits") {
  const auto cloud = test::random_positions(5'003, 100, 31);
  std::vector<Point> points;
  for (const auto& [x, y, z] : cloud) points.push_back({x, y, z});
  points[17].y = std::nanf("");
  points[4'000].z = 1e9f;
  const RigidTransform T{0.8f, -0.6f, 0, 3, 0.6f, 0.8f, 0, -2, 0, 0, 1, 5};
  const auto found = all_kernels();
  std::vector<CloudIndex> indexes;
  for (const Kernels* k : found) {
    indexes.emplace_back(bounding_grid(test::random_positions(100, 160, 32), 4'096), 6'000, *k);
    const PointTally tally = indexes.back().build(points, T);
    CHECK(tally.invalid == 1);
    CHECK(tally.culled >= 1);
  }
  for (const Position& query : test::random_positions(500, 200, 33))
    for (std::size_t k = 1; k < found.size(); ++k)
      CHECK(same_bits(indexes[k].nearest(query, {}), indexes[0].nearest(query, {})));
}

TEST_CASE("sixteen queries at once find what each finds alone, whatever the hints, the bound and the ties") {
  std::mt19937 random(35);
  std::vector<std::vector<Position>> clouds;
  for (const std::size_t size : {1u, 2u, 16u, 17u, 300u, 5'000u})
    clouds.push_back(test::random_positions(size, 60, static_cast<std::uint32_t>(size)));
  clouds.emplace_back(40, Position{1, 2, 3});  // a heap: whichever leaf is looked at, the distance is the same
  auto& lattice = clouds.emplace_back();       // every point twice, far from each other in the frame
  for (int copy = 0; copy < 2; ++copy)
    for (float x = 45; x >= -45; x -= 10)
      for (float y = -45; y <= 45; y += 10)
        for (float z = 45; z >= -45; z -= 10) lattice.push_back({x, y, z});
  for (const auto& cloud : clouds) {
    const std::size_t size = cloud.size();
    std::vector<Point> points;
    for (const auto& [x, y, z] : cloud) points.push_back({x, y, z});
    for (const Kernels* k : all_kernels()) {
      CloudIndex index(bounding_grid(cloud, 2'048), static_cast<std::uint32_t>(size), *k);
      index.build(points, identity_transform);
      for (int repetition = 0; repetition < 40; ++repetition) {
        auto queries = test::random_positions(16, 90, static_cast<std::uint32_t>(random()));
        if (repetition % 4 == 0)  // midway between points of the lattice
          for (Position& query : queries)
            for (float& coordinate : query) coordinate = 5 * std::round(coordinate / 5);
        float planes[3][16];
        std::uint32_t hints[16];
        for (std::size_t i = 0; i < 16; ++i) {
          for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = queries[i][axis];
          hints[i] = repetition % 2 == 0 ? NearestPoint::none : static_cast<std::uint32_t>(random() % size);
        }
        const float bound = repetition % 3 == 0 ? 100.0f : std::numeric_limits<float>::infinity();
        NearestPoints found;
        std::fill_n(found.squared, 16, bound);
        std::fill_n(found.point, 16, NearestPoint::none);
        std::fill_n(found.slot, 16, NearestPoint::none);
        const float* const coordinates[3] = {planes[0], planes[1], planes[2]};
        index.nearest_16(coordinates, hints, found);
        for (std::size_t i = 0; i < 16; ++i) {
          const NearestPoint alone = index.nearest(queries[i], {.squared = bound});
          CHECK(found.point[i] == alone.point);
          CHECK(found.squared[i] == alone.squared);
          if (alone.point != NearestPoint::none) CHECK(index.position(found.slot[i]) == cloud[alone.point]);
        }
      }
    }
  }
}

// Clouds of which many points are nearly equally distant from many queries, on every scale of rounding: rings and
// spheres around queries, shuffled copies. Rings took up to 18 times as long as ordinary clouds.
TEST_CASE("sixteen queries find what each finds alone where each of them has to test many points") {
  constexpr std::size_t size = 20'000;
  const auto random = test::random_positions(size, 1, 36);
  const auto cloud_of = [&](auto position) {
    std::vector<Position> cloud;
    for (std::size_t i = 0; i < size; ++i) cloud.push_back(position(i));
    return cloud;
  };
  std::vector<std::vector<Position>> clouds;
  for (const float radius : {1e-6f, 1e-4f, 0.03f, 1.0f, 20.0f})
    for (const float x : {0.0f, 50.0f}) {
      clouds.push_back(cloud_of([&](std::size_t i) {
        const float angle = 3.14159265f * random[i][0];
        return Position{x, radius * std::cos(angle), radius * std::sin(angle)};
      }));
      clouds.push_back(cloud_of([&](std::size_t i) {
        const float length = std::hypot(random[i][0], random[i][1], random[i][2]);
        const auto at = [&](std::size_t axis) { return radius / length * random[i][axis]; };
        return Position{x + at(0), at(1), at(2)};
      }));
    }
  clouds.push_back(cloud_of([&](std::size_t i) { return Position{random[i % 50][0], random[i % 7][1], 0}; }));
  for (const auto& cloud : clouds)
    for (const Kernels* k : all_kernels())
      for (const std::uint32_t cells : {1u, 50'000u}) {
        CloudIndex index(bounding_grid(cloud, cells), size, *k);
        std::vector<Point> points;
        for (const auto& [x, y, z] : cloud) points.push_back({x, y, z});
        index.build(points, identity_transform);
        NearestPoints found;
        for (int group = 0; group < 6; ++group) {
          float planes[3][16];
          std::uint32_t hints[16];
          const float aside = static_cast<float>(group % 3);
          for (std::size_t i = 0; i < 16; ++i) {  // on the axis of the rings, and beside it
            const Position query{static_cast<float>(16 * group) + static_cast<float>(i), 0.01f * aside * random[i][1],
                                 aside * random[i][2]};
            for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = query[axis];
            hints[i] = group % 2 == 0 ? NearestPoint::none : static_cast<std::uint32_t>(997 * i);
          }
          const float bound = group == 4 ? 400.0f : std::numeric_limits<float>::infinity();
          std::fill_n(found.squared, 16, bound);
          std::fill_n(found.point, 16, NearestPoint::none);
          const float* const coordinates[3] = {planes[0], planes[1], planes[2]};
          index.nearest_16(coordinates, hints, found);
          for (std::size_t i = 0; i < 16; ++i) {
            const NearestPoint alone = index.nearest({planes[0][i], planes[1][i], planes[2][i]}, {.squared = bound});
            CHECK(found.point[i] == alone.point);
            CHECK(found.squared[i] == alone.squared);
          }
        }
      }
}

TEST_CASE("projections and mode distances have the same bits everywhere") {
  std::mt19937 random(34);
  std::normal_distribution<float> value(0, 50);
  for (const std::size_t stride : {16u, 32u, 112u, 1'280u}) {
    std::vector<float> rows(5 * stride), f(stride), sample(3 * stride);
    std::array<std::vector<float>, 3> planes{f, f, f};
    for (auto* vector : {&rows, &f, &sample, &planes[0], &planes[1], &planes[2]})
      for (float& v : *vector) v = value(random);
    const float* const e[3] = {planes[0].data(), planes[1].data(), planes[2].data()};
    const float whole = kernels().mode_distance(e, sample.data(), stride, 1e30f);
    std::vector<float> expected(5);
    kernels().project(rows.data(), 5, stride, f.data(), expected.data());
    for (const Kernels* k : all_kernels()) {
      CHECK(k->mode_distance(e, sample.data(), stride, 1e30f) == whole);
      CHECK(k->mode_distance(e, sample.data(), stride, whole / 4) >=
            whole / 4);  // cut short, but never below the bound
      std::vector<float> coefficients(5);
      k->project(rows.data(), 5, stride, f.data(), coefficients.data());
      CHECK(coefficients == expected);
    }
  }
}

TEST_CASE("projections by 16-bit numbers are those by the same numbers as floats, everywhere") {
  std::mt19937 random(35);
  std::normal_distribution<float> value(0, 50);
  std::uniform_int_distribution<int> number(1, 65'535);
  for (const std::size_t stride : {16u, 48u, 1'152u}) {
    std::vector<std::uint16_t> numbers(5 * stride);
    std::vector<float> rows(numbers.size()), f(stride), expected(5);
    for (std::uint16_t& n : numbers) n = static_cast<std::uint16_t>(number(random));
    std::ranges::transform(numbers, rows.begin(), [](std::uint16_t n) { return static_cast<float>(n) - 32'768; });
    for (float& v : f) v = value(random);
    kernels().project(rows.data(), 5, stride, f.data(), expected.data());
    for (const Kernels* k : all_kernels()) {
      std::vector<float> coefficients(5);
      k->project_short(numbers.data(), 5, stride, f.data(), coefficients.data());
      CHECK(coefficients == expected);
    }
  }
}

TEST_CASE("adding a multiple rounds the product and the sum, with the same bits everywhere") {
  std::mt19937 random(36);
  std::normal_distribution<float> value(0, 50);
  for (const std::size_t count : {16u, 48u, 576u}) {
    std::vector<float> values(count), before(count), expected(count);
    for (auto* vector : {&values, &before})
      for (float& v : *vector) v = value(random);
    for (const float weight : {0.37f, -2.5f, 0.0f}) {
      for (std::size_t i = 0; i < count; ++i) {
        const volatile float product = weight * values[i];  // not fused with the addition
        expected[i] = before[i] + product;
      }
      for (const Kernels* k : all_kernels()) {
        std::vector<float> sum = before;
        k->add_multiple(weight, values.data(), count, sum.data());
        CHECK(sum == expected);
      }
    }
  }
}

namespace {

/// In double precision.
std::array<double, 10> moments_of(const std::vector<Leaf>& leaves, std::size_t points, const Position& place,
                                  double reach) {
  std::array<double, 10> sums{};
  for (std::size_t i = 0; i < points; ++i) {
    const Leaf& leaf = leaves[i / 16];
    const double x = double{leaf.x[i % 16]} - double{place[0]}, y = double{leaf.y[i % 16]} - double{place[1]},
                 z = double{leaf.z[i % 16]} - double{place[2]};
    const double w = std::max(1 - (x * x + y * y + z * z) / (reach * reach), 0.0);
    const double terms[] = {1, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};
    for (std::size_t moment = 0; moment < sums.size(); ++moment) sums[moment] += w * terms[moment];
  }
  return sums;
}

/// The rest of the last leaf has no points.
std::vector<Leaf> leaves_around(const Position& place, const std::vector<Position>& points) {
  std::vector<Leaf> leaves((points.size() + 15) / 16);
  for (std::size_t i = 0; i < 16 * leaves.size(); ++i) {
    Leaf& leaf = leaves[i / 16];
    float* const lane[] = {&leaf.x[i % 16], &leaf.y[i % 16], &leaf.z[i % 16]};
    for (std::size_t axis = 0; axis < 3; ++axis)
      *lane[axis] = i < points.size() ? place[axis] + points[i][axis] : std::numeric_limits<float>::infinity();
  }
  return leaves;
}

}  // namespace

TEST_CASE("moments are those of the near points alone, with the same bits everywhere") {
  constexpr float reach = 8;
  constexpr Position place{128, -64, 32};
  for (const std::size_t count : {0u, 3u, 16u, 45u, 128u}) {
    const std::vector<Leaf> leaves = leaves_around(place, test::random_positions(count, 10, 37));
    std::vector<const Leaf*> pointers;
    for (const Leaf& leaf : leaves) pointers.push_back(&leaf);
    const std::array<double, 10> exact = moments_of(leaves, count, place, double{reach});
    std::array<float, 10> expected{};
    kernels().sum_moments(pointers.data(), pointers.size(), place.data(), reach, expected.data());
    for (std::size_t moment = 0; moment < exact.size(); ++moment) {
      const double most = moment == 0 ? 1 : moment < 4 ? 8 : 64;  // of a term, by the reach
      // Of the additions, and of the operations of a term
      const double rounding = (static_cast<double>(count) + 8) * std::numeric_limits<float>::epsilon();
      CHECK(std::abs(double{expected[moment]} - exact[moment]) <= static_cast<double>(count) * most * rounding);
    }
    if (count > 16) CHECK(expected[0] > 0);
    for (const Kernels* k : all_kernels()) {
      std::array<float, 10> sums{};
      k->sum_moments(pointers.data(), pointers.size(), place.data(), reach, sums.data());
      CHECK(std::memcmp(sums.data(), expected.data(), sizeof(sums)) == 0);
    }
  }
}

TEST_CASE("no point is near a place that is no number, or within a reach of 0") {
  const std::vector<Leaf> leaves = leaves_around({0, 0, 0}, {{0, 0, 0}, {1, 2, 3}});
  const Leaf* const only = leaves.data();
  for (const Kernels* k : all_kernels())
    for (const auto& [place, reach] : {std::pair{Position{std::nanf(""), 0, 0}, 8.0f}, {Position{0, 0, 0}, 0.0f}}) {
      std::array<float, 10> sums;
      sums.fill(1);
      k->sum_moments(&only, 1, place.data(), reach, sums.data());
      CHECK(sums == std::array<float, 10>{});
    }
}
