// Searches a baked tree, to show that it finds the nearest vertices. The matcher needs no such search.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::test {

struct NearestVertex {
  std::uint32_t vertex = std::numeric_limits<std::uint32_t>::max();
  float distance = std::numeric_limits<float>::infinity();
};

inline float squared_distance(const std::array<float, 3>& a, const std::array<float, 3>& b) noexcept {
  const float dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

inline float squared_distance_to_box(const std::array<float, 6>& box, const std::array<float, 3>& p) noexcept {
  float sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float outside = std::max({box[axis] - p[axis], p[axis] - box[axis + 3], 0.0f});
    sum += outside * outside;
  }
  return sum;
}

/// The exact nearest vertex; ties go to the lower index. The default NearestVertex when none is within `max_distance`.
inline NearestVertex nearest_vertex(const VertexTree& tree, std::array<float, 3> point,
                                    float max_distance = std::numeric_limits<float>::infinity()) noexcept {
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

}  // namespace lbea::test
