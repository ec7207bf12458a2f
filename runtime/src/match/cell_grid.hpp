// A grid of cubic cells, numbered along a Morton curve: neighbours in space are mostly neighbours in number.
#pragma once

#include "runtime/src/model/model_view.hpp"

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
  std::uint32_t halvings = 0;       // 1: a cell is ranked as its eight octants, rank + (x odd) + 2 (y odd) + 4 (z odd)
  std::vector<std::uint32_t> rank;  // cells x*y*z: place along the curve, or `outside`; then `outside` once more
  std::uint32_t ranks = 0;          // octants included

  /// `outside` for positions beyond the grid and not finite ones.
  [[nodiscard]] std::uint32_t rank_of(const std::array<float, 3>& position) const noexcept {
    std::size_t cell = 0, stride = 1;
    std::uint32_t octant = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float along = (position[axis] - corner[axis]) * cells_per_length;
      if (!(along >= 0 && along < static_cast<float>(cells[axis]))) return outside;
      const auto fine = static_cast<std::uint32_t>(along * static_cast<float>(1u << halvings));
      cell += stride * (fine >> halvings);
      octant |= (fine & halvings) << axis;
      stride *= cells[axis];
    }
    return rank[cell] | octant;
  }
};

/// The ensemble's envelope: cells whose bit is not set are `outside`.
[[nodiscard]] CellGrid envelope_grid(const EnvelopeView& envelope);

/// A grid around all of `positions` with about `cell_count` cells, none of them outside.
[[nodiscard]] CellGrid bounding_grid(std::span<const std::array<float, 3>> positions, std::uint32_t cell_count);

}  // namespace lbea
