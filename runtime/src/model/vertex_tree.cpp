#include "runtime/src/model/vertex_tree.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

float squared_distance(const std::array<float, 3>& a, const std::array<float, 3>& b) noexcept {
  const float dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

float squared_distance_to_box(const std::array<float, 6>& box, const std::array<float, 3>& p) noexcept {
  float sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float outside = std::max({box[axis] - p[axis], p[axis] - box[axis + 3], 0.0f});
    sum += outside * outside;
  }
  return sum;
}

}  // namespace

bool ranges_form_one_tree(const VertexTree& tree) noexcept {
  struct Subtree {
    std::uint32_t node, first, count;
  };
  std::array<Subtree, vertex_tree_max_depth> right_siblings;  // not yet visited, innermost last
  std::size_t depth = 0;
  Subtree expected{0, 0, static_cast<std::uint32_t>(tree.vertices.size())};
  for (std::uint32_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    if (node != expected.node || first != expected.first || count != expected.count || count == 0) return false;
    if (right == 0) {
      if (depth == 0) return node + 1 == tree.ranges.size();
      expected = right_siblings[--depth];
      continue;
    }
    if (depth == right_siblings.size() || right <= node + 1 || right >= tree.ranges.size()) return false;
    const std::uint32_t left_count = tree.ranges[node + 1][1];
    if (left_count >= count) return false;
    right_siblings[depth++] = {right, first + left_count, count - left_count};
    expected = {node + 1, first, left_count};
  }
  return false;
}

bool boxes_hold_their_vertices(const VertexTree& tree) noexcept {
  for (std::size_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    const auto& box = tree.boxes[node];
    const auto held = [&](const std::array<float, 3>& v) {
      return box[0] <= v[0] && v[0] <= box[3] && box[1] <= v[1] && v[1] <= box[4] && box[2] <= v[2] && v[2] <= box[5];
    };
    if (!std::ranges::all_of(tree.vertices.subspan(first, count), held)) return false;
  }
  return true;
}

NearestVertex nearest_vertex(const VertexTree& tree, std::array<float, 3> point, float max_distance) noexcept {
  struct Pending {
    std::uint32_t node;
    float bound;
  };
  std::array<Pending, vertex_tree_max_depth + 1> stack;  // per level: the sibling not yet visited
  std::size_t depth = 0;
  NearestVertex best;
  float best_squared = max_distance * max_distance;
  if (!tree.ranges.empty()) stack[depth++] = {0, squared_distance_to_box(tree.boxes[0], point)};
  while (depth > 0) {
    const Pending pending = stack[--depth];
    if (pending.bound > best_squared) continue;
    const auto [first, count, right] = tree.ranges[pending.node];
    if (right == 0) {
      for (std::uint32_t v = first; v < first + count; ++v) {
        const float squared = squared_distance(tree.vertices[v], point);
        if (squared < best_squared || (squared == best_squared && v < best.vertex)) {
          best_squared = squared;
          best.vertex = v;
        }
      }
      continue;
    }
    Pending near{pending.node + 1, squared_distance_to_box(tree.boxes[pending.node + 1], point)};
    Pending far{right, squared_distance_to_box(tree.boxes[right], point)};
    if (far.bound < near.bound) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  if (best.vertex != NearestVertex{}.vertex) best.distance = std::sqrt(best_squared);
  return best;
}

}  // namespace lbea
