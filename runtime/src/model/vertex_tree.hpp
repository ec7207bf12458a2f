// The baked KD-tree over a reference mesh: finds the vertex nearest to a point.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
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

struct NearestVertex {
  std::uint32_t vertex = std::numeric_limits<std::uint32_t>::max();
  float distance = std::numeric_limits<float>::infinity();
};

/// The exact nearest vertex; ties go to the lower index. The default NearestVertex when none is within `max_distance`.
[[nodiscard]] NearestVertex nearest_vertex(const VertexTree& tree, std::array<float, 3> point,
                                           float max_distance = std::numeric_limits<float>::infinity()) noexcept;

}  // namespace lbea
