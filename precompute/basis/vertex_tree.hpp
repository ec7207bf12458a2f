// The KD-tree of runtime/FORMAT.md sections 38 and 39: flat, index-based, the same for the same points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::bake {

/// Preorder: node 0 is the root, the left child of node k is k + 1. No points, no nodes.
struct BakedTree {
  std::vector<std::uint32_t> order;                  // the points in the order of the leaves, ascending within a leaf
  std::vector<std::array<float, 6>> boxes;           // per node: min x, y, z, max x, y, z of its points
  std::vector<std::array<std::uint32_t, 3>> ranges;  // per node: first in `order`, count, right child (0: a leaf)
};

/// positions: n x 3, finite. Splits at the median of the box's longest side; equal coordinates by index.
[[nodiscard]] BakedTree build_vertex_tree(std::span<const float> positions);

}  // namespace lbea::bake
