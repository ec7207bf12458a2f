#include "runtime/src/match/cell_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lbea {
namespace {

constexpr std::size_t most_octants = 1 << 20;  // an index keeps eight bytes for each

// Every third bit of the result, from bit 0 on: 16 bits of a cell coordinate spread for a Morton key.
std::uint64_t spread(std::uint64_t bits) noexcept {
  std::uint64_t result = 0;
  for (unsigned bit = 0; bit < 16; ++bit) result |= (bits >> bit & 1u) << (3 * bit);
  return result;
}

// Ranks the cells for which `holds(cell)` along the Morton curve.
template <typename Holds>
void rank_cells(CellGrid& grid, Holds holds) {
  const std::size_t count = std::size_t{grid.cells[0]} * grid.cells[1] * grid.cells[2];
  std::vector<std::pair<std::uint64_t, std::size_t>> curve;
  std::size_t cell = 0;
  for (std::uint64_t z = 0; z < grid.cells[2]; ++z)
    for (std::uint64_t y = 0; y < grid.cells[1]; ++y)
      for (std::uint64_t x = 0; x < grid.cells[0]; ++x, ++cell)
        if (holds(cell)) curve.emplace_back(spread(x) | spread(y) << 1 | spread(z) << 2, cell);
  std::ranges::sort(curve);
  grid.rank.assign(count + 1, CellGrid::outside);  // the last one: for positions outside
  grid.halvings = curve.size() <= most_octants / 8 ? 1 : 0;
  for (const auto& [key, place] : curve) {
    grid.rank[place] = grid.ranks;
    grid.ranks += 1u << (3 * grid.halvings);
  }
}

}  // namespace

CellGrid envelope_grid(const EnvelopeView& envelope) {
  CellGrid grid;
  grid.corner = envelope.corner;
  grid.cells_per_length = 1.0f / envelope.cell;
  grid.cells = envelope.cells;
  rank_cells(grid, [&](std::size_t cell) { return (envelope.bits[cell / 64] >> (cell % 64) & 1u) != 0; });
  return grid;
}

CellGrid bounding_grid(std::span<const std::array<float, 3>> positions, std::uint32_t cell_count) {
  CellGrid grid;
  std::array<float, 3> low{}, high{};
  for (std::size_t axis = 0; axis < 3 && !positions.empty(); ++axis) {
    const auto [nearest, farthest] = std::ranges::minmax(positions, {}, [axis](const auto& p) { return p[axis]; });
    low[axis] = nearest[axis];
    high[axis] = farthest[axis];
  }
  // Flat clouds, and a heap of equal points, still have a volume to divide: the edge of a cell stays well above the
  // rounding of coordinates, and no axis counts for less than a hundredth of the longest.
  constexpr float least_relative = 1e-3f, least = 1e-6f;
  float longest = least;
  for (std::size_t axis = 0; axis < 3; ++axis)
    longest = std::max(
        {longest, high[axis] - low[axis], least_relative * std::abs(low[axis]), least_relative * std::abs(high[axis])});
  float volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) volume *= std::max((high[axis] - low[axis]) / longest, 0.01f);
  const float edge = longest * std::cbrt(volume / static_cast<float>(cell_count));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.cells[axis] =
        static_cast<std::uint32_t>((high[axis] - low[axis]) / edge) + 2;  // half a cell to spare on both sides
    grid.corner[axis] = low[axis] - 0.5f * edge;
  }
  grid.cells_per_length = 1.0f / edge;
  rank_cells(grid, [](std::size_t) { return true; });
  return grid;
}

}  // namespace lbea
