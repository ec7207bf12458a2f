// Orders the points of cells that hold very many of them.
#pragma once

#include "runtime/src/kernels/kernels.hpp"

#include <array>
#include <span>
#include <vector>

namespace lbea {

/// Points keep the frame's order within their cell. When a cell holds very many, its leaves may all enclose nearly the
/// same box, and every search nearby would test each of them. So the points of the largest cells are ordered along a
/// Morton curve.
class CrowdedCells {
 public:
  /// Allocates all memory, for clouds of up to `max_points`.
  explicit CrowdedCells(std::uint32_t max_points);

  /// Cells with more points than this are crowded; a cloud of a surface has none.
  [[nodiscard]] static std::uint32_t limit(std::size_t points) noexcept;

  void clear() noexcept { ranges_.clear(); }
  /// Registers the places of a crowded cell's points. The cells do not overlap.
  void add(std::uint32_t begin, std::uint32_t count) noexcept { ranges_.push_back({begin, count}); }
  [[nodiscard]] bool empty() const noexcept { return ranges_.empty(); }

  /// Orders the points at the registered places. `points` holds the bytes of PlacedPoints; `spare` and `keys` have as
  /// many elements. Points nearer to each other than `resolution` keep their order. Linear in the number of points.
  /// Does not allocate.
  void sort(std::span<std::byte> points, PlacedPoint* spare, std::uint32_t* keys, float resolution) noexcept;

 private:
  struct Range {
    std::uint32_t begin, count;
  };
  void divide(std::byte* points, Range range, PlacedPoint* spare, std::uint32_t* keys, float resolution) noexcept;

  static constexpr std::uint32_t bits = 4;  // per axis and pass
  std::vector<Range> ranges_;               // coarse ones first
  std::array<std::uint32_t, (1u << (3 * bits))> ends_{};
};

}  // namespace lbea
