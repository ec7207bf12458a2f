#include "precompute/basis/reference_basis.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/runtime/match/brute_force.hpp"
#include "tests/support/nearest_vertex.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using lbea::test::nearest_vertex;
using lbea::test::NearestVertex;
using lbea::test::Position;

namespace {

struct OwnedTree {
  explicit OwnedTree(const std::vector<Position>& positions)
      : baked(build_vertex_tree({positions.empty() ? nullptr : positions[0].data(), 3 * positions.size()})) {
    for (const std::uint32_t i : baked.order) vertices.push_back(positions[i]);
  }
  [[nodiscard]] VertexTree view() const { return {vertices, baked.boxes, baked.ranges}; }

  BakedTree baked;
  std::vector<Position> vertices;
};

}  // namespace

TEST_CASE("nearest vertices equal brute force over sizes around the leaf") {
  for (const std::size_t size : {1u, 2u, 15u, 16u, 17u, 33u, 1'000u}) {
    CAPTURE(size);
    const OwnedTree tree(test::random_positions(size, 100, static_cast<std::uint32_t>(size)));
    REQUIRE(ranges_form_one_tree(tree.view()));
    REQUIRE(boxes_hold_their_vertices(tree.view()));
    for (const Position& query : test::random_positions(200, 150, 9)) {
      const NearestVertex found = nearest_vertex(tree.view(), query);
      const auto expected = test::brute_force(tree.vertices, query);
      CHECK(found.distance == doctest::Approx(std::sqrt(expected.squared)).epsilon(1e-5));
      const NearestVertex bounded = nearest_vertex(tree.view(), query, 10);
      CHECK((bounded.vertex == found.vertex) == (found.distance <= 10));
    }
  }
}

TEST_CASE("an empty tree has no nearest vertex, equal distances go to the lower vertex") {
  CHECK(nearest_vertex({}, {0, 0, 0}).vertex == NearestVertex{}.vertex);
  const OwnedTree heap(std::vector<Position>(40, Position{1, 1, 1}));
  CHECK(nearest_vertex(heap.view(), {0, 0, 0}).vertex == 0);
}

// It overran the stack of nearest_vertex(), and its boxes took quadratic time to check.
TEST_CASE("a chain of nodes, deeper than a search has memory for, is not a tree") {
  for (const std::uint32_t depth : {vertex_tree_max_depth, vertex_tree_max_depth + 1}) {
    const std::vector<Position> vertices(depth + 1);
    std::vector<std::array<std::uint32_t, 3>> ranges;
    for (std::uint32_t first = 0; first < depth; ++first) {  // a vertex to the left, all others to the right
      ranges.push_back({first, depth + 1 - first, static_cast<std::uint32_t>(ranges.size()) + 2});
      ranges.push_back({first, 1, 0});
    }
    ranges.push_back({depth, 1, 0});
    CHECK(ranges_form_one_tree({vertices, {}, ranges}) == (depth <= vertex_tree_max_depth));
  }
}
