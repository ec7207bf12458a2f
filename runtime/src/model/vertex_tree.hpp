// The baked KD-tree over a reference mesh: which vertex is nearest to this point?
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace lbea {

/// Flat, index-based view; layout in FORMAT.md, sections 34, 38 and 39. Validated at open.
struct VertexTree {
  std::span<const std::array<float, 3>> vertices;
  std::span<const std::array<float, 6>> boxes;
  std::span<const std::array<std::uint32_t, 3>> ranges;
};

// Checks at open. Only a tree that passes both may be searched.
[[nodiscard]] bool ranges_form_one_tree(const VertexTree& tree) noexcept;
[[nodiscard]] bool boxes_hold_their_vertices(const VertexTree& tree) noexcept;  // after the ranges

inline constexpr std::uint32_t vertex_tree_leaf = 16;
inline constexpr std::uint32_t vertex_tree_max_depth = 64;

struct NearestVertex {
  std::uint32_t vertex = std::numeric_limits<std::uint32_t>::max();
  float distance = std::numeric_limits<float>::infinity();
};

/// Exact nearest vertex, ties to the lower index. No vertex within `max_distance`: the default NearestVertex.
[[nodiscard]] NearestVertex nearest_vertex(const VertexTree& tree, std::array<float, 3> point,
                                           float max_distance = std::numeric_limits<float>::infinity()) noexcept;

}  // namespace lbea
