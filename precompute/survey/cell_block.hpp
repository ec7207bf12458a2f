// 4 x 4 x 4 cells as the bits of a word: x + 4 y + 16 z from the first one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace lbea::bake {

struct CellBlock {
  /// The cells that share a position's x, its y and its z.
  struct Planes {
    std::uint64_t x, y, z;
  };

  /// Begins at the cell that holds `low`, which is not negative; in cells.
  explicit CellBlock(const std::array<double, 3>& low) {
    for (std::size_t axis = 0; axis < 3; ++axis) first[axis] = static_cast<std::uint32_t>(low[axis]);
  }

  /// Of a position less than four cells beyond the first one.
  [[nodiscard]] Planes planes(const std::array<double, 3>& position) const {
    const auto along = [&](std::size_t axis) { return static_cast<std::uint32_t>(position[axis]) - first[axis]; };
    return {0x1111'1111'1111'1111u << along(0), 0x000f'000f'000f'000fu << (4 * along(1)),
            std::uint64_t{0xffff} << (16 * along(2))};
  }
  /// Their bounding box, when that is not larger than a cell: then no cell lies between two that hold a corner.
  [[nodiscard]] static std::uint64_t box(const Planes& a, const Planes& b, const Planes& c) {
    return (a.x | b.x | c.x) & (a.y | b.y | c.y) & (a.z | b.z | c.z);
  }

  std::array<std::uint32_t, 3> first{};
};

}  // namespace lbea::bake
