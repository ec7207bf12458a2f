// Which points of a file are one node although the file lists them several times.
#pragma once

#include "adapters/simulation/grid/grid.hpp"

namespace lbea::io::grid {
/// Point -> the first point that is the same node; empty when the file lists every node once.
/// Points with equal coordinates are one node in a triangle soup. Pieces of a mesh repeat the nodes on their common
/// border: points of different pieces are one node when they have the same id or, without ids, when their coordinates
/// are equal and no piece has two points there.
[[nodiscard]] std::vector<std::uint32_t> joined_points(const Grid& grid);

/// Throws Error{bad_input} when points that are one node in the file `first` are at different places in `file`.
void require_joined(const Grid& grid, const std::vector<std::uint32_t>& joined, const std::string& file,
                    const std::string& first);
}  // namespace lbea::io::grid
