#include "precompute/basis/reference_basis.hpp"

#include "tests/support/nearest_vertex.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

using namespace lbea;
using namespace lbea::bake;

namespace {

std::vector<float> random_positions(std::size_t count, int distinct, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coordinate(0, distinct - 1);
  std::vector<float> positions(3 * count);
  for (float& x : positions) x = static_cast<float>(coordinate(random));
  return positions;
}

std::vector<std::array<float, 3>> in_order(const std::vector<float>& positions, const BakedTree& tree) {
  std::vector<std::array<float, 3>> sorted;
  for (const std::uint32_t i : tree.order)
    sorted.push_back({positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]});
  return sorted;
}

void check_tree(const std::vector<float>& positions) {
  const BakedTree tree = build_vertex_tree(positions);
  const auto vertices = in_order(positions, tree);
  std::vector<std::uint32_t> all(positions.size() / 3);
  std::iota(all.begin(), all.end(), 0u);
  std::vector<std::uint32_t> sorted = tree.order;
  std::ranges::sort(sorted);
  CHECK(sorted == all);
  CHECK(tree.boxes.size() == tree.ranges.size());

  const VertexTree view{vertices, tree.boxes, tree.ranges};
  REQUIRE(ranges_form_one_tree(view));
  CHECK(boxes_hold_their_vertices(view));
  for (std::size_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    CHECK((right == 0) == (count <= vertex_tree_leaf));
    const auto members = std::span(vertices).subspan(first, count);
    for (std::size_t axis = 0; axis < 3; ++axis) {  // tight
      const auto [least, most] = std::ranges::minmax(members, {}, [axis](const auto& p) { return p[axis]; });
      CHECK(tree.boxes[node][axis] == least[axis]);
      CHECK(tree.boxes[node][axis + 3] == most[axis]);
    }
    if (right == 0) {
      CHECK(std::ranges::is_sorted(std::span(tree.order).subspan(first, count)));
    } else {
      const auto left_count = tree.ranges[node + 1][1];
      CHECK(left_count == count / 2);
      const auto& box = tree.boxes[node];
      const std::array<float, 3> sides{box[3] - box[0], box[4] - box[1], box[5] - box[2]};
      const auto axis = static_cast<std::size_t>(std::ranges::max_element(sides) - sides.begin());
      CHECK(tree.boxes[node + 1][axis + 3] <= tree.boxes[right][axis]);  // left lies left
    }
  }
  const BakedTree again = build_vertex_tree(positions);
  CHECK(again.order == tree.order);
  CHECK(again.ranges == tree.ranges);
}

}  // namespace

TEST_CASE("the tree holds every vertex once, in tight boxes, split at the median") {
  for (const std::size_t count : {1u, 2u, 15u, 16u, 17u, 32u, 33u, 1000u}) {
    CAPTURE(count);
    check_tree(random_positions(count, 1000, 1));
    check_tree(random_positions(count, 3, 2));  // many equal
    check_tree(random_positions(count, 1, 3));  // all equal
  }
}

TEST_CASE("without vertices the tree is empty") {
  const BakedTree tree = build_vertex_tree({});
  CHECK(tree.order.empty());
  CHECK(tree.ranges.empty());
}

TEST_CASE("equal coordinates are split by index") {
  const BakedTree tree = build_vertex_tree(std::vector<float>(3 * 40, 7.0f));
  CHECK(std::ranges::is_sorted(tree.order));
}

TEST_CASE("a search of the tree finds the nearest vertex") {
  const std::vector<float> positions = random_positions(700, 30, 4);
  const BakedTree tree = build_vertex_tree(positions);
  const auto vertices = in_order(positions, tree);
  const VertexTree view{vertices, tree.boxes, tree.ranges};
  std::mt19937 random(5);
  std::uniform_real_distribution<float> coordinate(-10, 40);
  for (int query = 0; query < 500; ++query) {
    const std::array<float, 3> at{coordinate(random), coordinate(random), coordinate(random)};
    const auto squared = [&](const std::array<float, 3>& v) {
      return (v[0] - at[0]) * (v[0] - at[0]) + (v[1] - at[1]) * (v[1] - at[1]) + (v[2] - at[2]) * (v[2] - at[2]);
    };
    const auto nearest = std::ranges::min_element(vertices, {}, squared);
    CHECK(lbea::test::nearest_vertex(view, at).vertex == static_cast<std::uint32_t>(nearest - vertices.begin()));
  }
}
