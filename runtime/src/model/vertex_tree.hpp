// The baked KD-tree over the vertices of a reference mesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace lbea {

/// Layout in FORMAT.md, sections 34, 38 and 39. Checked when the model is opened.
struct VertexTree {
  std::span<const std::array<float, 3>> vertices;
  std::span<const std::array<float, 6>> boxes;
  std::span<const std::array<std::uint32_t, 3>> ranges;
};

// The checks at open. Only a tree that passes both may be searched.
[[nodiscard]] bool ranges_form_one_tree(const VertexTree& tree) noexcept;
[[nodiscard]] bool boxes_hold_their_vertices(const VertexTree& tree) noexcept;  // after the other check

inline constexpr std::uint32_t vertex_tree_leaf = 16;
inline constexpr std::uint32_t vertex_tree_max_depth = 64;

}  // namespace lbea
