// A grid of cubic cells, numbered along a Morton curve: neighbours in space are mostly neighbours in number.
#pragma once

#include "runtime/src/model_view.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lbea {

struct CellGrid {
  static constexpr std::uint32_t outside = std::numeric_limits<std::uint32_t>::max();

  std::array<float, 3> corner{};
  float cells_per_length = 1;
  std::array<std::uint32_t, 3> cells{1, 1, 1};
  std::vector<std::uint32_t> rank;  // cells x*y*z: place along the curve, or `outside`
  std::uint32_t ranks = 0;

  /// The rank of the cell that holds the position, `outside` for positions beyond the grid and not finite ones.
  [[nodiscard]] std::uint32_t rank_of(float x, float y, float z) const noexcept {
    const float cx = (x - corner[0]) * cells_per_length;
    const float cy = (y - corner[1]) * cells_per_length;
    const float cz = (z - corner[2]) * cells_per_length;
    const bool inside = cx >= 0 && cy >= 0 && cz >= 0 && cx < static_cast<float>(cells[0]) &&
                        cy < static_cast<float>(cells[1]) && cz < static_cast<float>(cells[2]);
    if (!inside) return outside;  // also for NaN, which compares false
    const auto ix = static_cast<std::size_t>(cx), iy = static_cast<std::size_t>(cy), iz = static_cast<std::size_t>(cz);
    return rank[ix + cells[0] * (iy + cells[1] * iz)];
  }
};

/// The ensemble's envelope: cells whose bit is not set are `outside`.
[[nodiscard]] CellGrid envelope_grid(const EnvelopeView& envelope);

/// A grid around all of `positions` with about `cell_count` cells, none of them outside.
[[nodiscard]] CellGrid bounding_grid(std::span<const std::array<float, 3>> positions, std::uint32_t cell_count);

}  // namespace lbea
