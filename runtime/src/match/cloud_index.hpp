// The index over the cloud of a frame: the points in Morton order, in leaves of 16, under a 16-ary tree of boxes.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {
/// A grid of cubic cells, numbered along a Morton curve: cells that are near in space are mostly near in number.
struct CellGrid {
  static constexpr std::uint32_t outside = std::numeric_limits<std::uint32_t>::max();

  std::array<float, 3> corner{};
  float cells_per_length = 1;
  std::array<std::uint32_t, 3> cells{1, 1, 1};
  std::uint32_t halvings = 0;       // 1: each cell has a rank per octant, rank + (x odd) + 2 (y odd) + 4 (z odd)
  std::vector<std::uint32_t> rank;  // cells x*y*z: place along the curve, or `outside`; one more `outside` at the end
  std::uint32_t ranks = 0;          // octants included

  /// `outside` for positions that are beyond the grid or not finite.
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

/// The grid of the ensemble's envelope: cells whose bit is not set are `outside`.
[[nodiscard]] CellGrid envelope_grid(const EnvelopeView& envelope);

/// A grid around `positions` with about `cell_count` cells, none of them `outside`.
[[nodiscard]] CellGrid bounding_grid(std::span<const std::array<float, 3>> positions, std::uint32_t cell_count);

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

  std::vector<Range> ranges_;        // coarse ones first
  std::vector<std::uint32_t> ends_;  // per part of a range
};

class CloudIndex {
 public:
  static constexpr std::size_t fanout = 16;

  /// Allocates all memory, for clouds of up to `max_points`.
  CloudIndex(CellGrid grid, std::uint32_t max_points, const Kernels& code = kernels());

  /// Transforms the points into reference coordinates, drops those outside the grid and indexes the rest. At most
  /// max_points points. Linear in their number; fastest when consecutive points are near each other. Does not allocate.
  PointTally build(std::span<const Point> points, const RigidTransform& T_reference_sensor) noexcept;

  /// The exact nearest point among those with squared distance <= bound.squared; `bound` itself when there is none.
  /// Ties go to the point that comes first in the frame.
  [[nodiscard]] NearestPoint nearest(const std::array<float, 3>& query, NearestPoint bound) const noexcept {
    return size_ > 0 ? kernels_.nearest(tree_, query.data(), bound) : bound;
  }

  /// The slot of a point that is probably near `position`; none when no point is known there.
  [[nodiscard]] std::uint32_t hint(const std::array<float, 3>& position) const noexcept;
  /// The same as nearest() for 16 queries (x, y, z planes) that are near each other, with a hint for each.
  void nearest_16(const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) const noexcept {
    if (size_ > 0) kernels_.nearest_16(tree_, queries, hints, best);
  }
  /// Reference coordinates of the point in a slot that a search returned.
  [[nodiscard]] std::array<float, 3> position(std::uint32_t slot) const noexcept {
    const Leaf& leaf = leaves_[slot / fanout];
    return {leaf.x[slot % fanout], leaf.y[slot % fanout], leaf.z[slot % fanout]};
  }

  /// Leaves that hold the last points of the eight cells around a position, each once; their number. Points at infinity
  /// fill the last leaf.
  std::size_t find_around(const std::array<float, 3>& position, std::array<const Leaf*, 8>& leaves) const noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Whether some cells hold very many points, which those of the cloud of a surface do not.
  [[nodiscard]] bool is_crowded() const noexcept { return tree_.is_crowded; }

  /// Kernels::add_depths for the indexed points, seen from a camera at T_sensor_reference.
  void add_depths(const RigidTransform& T_sensor_reference, const CellRaster& raster,
                  CellTally* tallies) const noexcept {
    kernels_.add_depths(leaves_.data(), (size_ + fanout - 1) / fanout, T_sensor_reference.data(), raster, tallies);
  }

 private:
  struct Cell {
    std::uint32_t points;  // number of points while they are counted; 0 otherwise
    std::uint32_t next;    // of an occupied cell: where its next point goes; after sorting, the end of its points
  };
  void count_runs(std::span<const Point> points, PointTally& tally) noexcept;
  void assign_places(std::size_t received) noexcept;
  void move_points(std::size_t count) noexcept;
  void order_crowded_cells() noexcept;
  void enclose() noexcept;
  void find_first_places() noexcept;

  const Kernels& kernels_;
  CellGrid grid_;
  std::uint32_t size_ = 0;
  std::vector<PlacedPoint> placed_;  // per point of the frame: reference coordinates
  std::vector<std::uint32_t> rank_;  // per point: rank of its cell
  // Runs: consecutive points of the frame in one cell.
  std::size_t run_count_ = 0;
  std::vector<std::uint32_t> run_begin_;           // place in the frame; a run ends where the next one begins
  std::vector<std::uint32_t> run_shift_;           // place after sorting minus place in the frame, modulo 2^32
  std::vector<Cell> cells_;                        // per rank
  std::vector<std::uint64_t> occupied_;            // bit per rank
  std::vector<Leaf> leaves_;                       // while they are filled: the bytes of 16 sorted points each
  std::vector<std::vector<BoxGroup>> levels_;      // [0]: the leaves' boxes
  std::vector<std::vector<std::uint32_t>> first_;  // per box of a crowded cloud
  CrowdedCells crowded_;
  CloudTree tree_{};
};
}  // namespace lbea
