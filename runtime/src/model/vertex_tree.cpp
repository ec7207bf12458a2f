#include "runtime/src/model/vertex_tree.hpp"

#include <algorithm>

namespace lbea {
bool ranges_form_one_tree(const VertexTree& tree) noexcept {
  struct Subtree {
    std::uint32_t node, first, count, level;
  };
  std::array<Subtree, vertex_tree_max_depth> right_siblings;  // not yet visited, innermost last
  std::size_t depth = 0;
  Subtree expected{0, 0, static_cast<std::uint32_t>(tree.vertices.size()), 0};
  for (std::uint32_t node = 0; node < tree.ranges.size(); ++node) {
    const auto [first, count, right] = tree.ranges[node];
    if (node != expected.node || first != expected.first || count != expected.count || count == 0) return false;
    if (right == 0) {
      if (depth == 0) return node + 1 == tree.ranges.size();
      expected = right_siblings[--depth];
      continue;
    }
    const std::uint32_t below = expected.level + 1;
    if (below > vertex_tree_max_depth || right <= node + 1 || right >= tree.ranges.size()) return false;
    const std::uint32_t left_count = tree.ranges[node + 1][1];
    if (left_count >= count) return false;
    right_siblings[depth++] = {right, first + left_count, count - left_count, below};
    expected = {node + 1, first, left_count, below};
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

}  // namespace lbea
