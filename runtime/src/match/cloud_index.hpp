// An index over one fresh cloud: the points in Morton order, in leaves of 16, under a 16-ary tree of boxes.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/match/cell_grid.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

class CloudIndex {
 public:
  static constexpr std::size_t fanout = 16;

  /// All memory is allocated here, for clouds of up to `max_points`.
  CloudIndex(CellGrid grid, std::uint32_t max_points, const Kernels& code = kernels());

  /// Brings the points into reference coordinates, drops those outside the grid and indexes the rest.
  /// `points` may not be more than max_points. Linear in their number, and fastest when points that follow each other
  /// are neighbours; no allocation.
  PointTally build(std::span<const Point> points, const RigidTransform& T_reference_sensor) noexcept;

  /// The exact nearest point among those with squared distance <= bound.squared; `bound` itself when none
  /// is nearer. Equal distances go to the lower place in the frame.
  [[nodiscard]] NearestPoint nearest(const std::array<float, 3>& query, NearestPoint bound) const noexcept {
    return size_ > 0 ? kernels_.nearest(tree_, query.data(), bound) : bound;
  }

  /// A slot with a point that is probably near to `position`; none when nothing is known there.
  [[nodiscard]] std::uint32_t hint(const std::array<float, 3>& position) const noexcept;
  /// The same as nearest() for 16 queries near each other (x, y, z planes), with a hint for each.
  void nearest_16(const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) const noexcept {
    if (size_ > 0) kernels_.nearest_16(tree_, queries, hints, best);
  }
  /// Reference coordinates of the point in a slot that a search has named.
  [[nodiscard]] std::array<float, 3> position(std::uint32_t slot) const noexcept {
    const Leaf& leaf = leaves_[slot / fanout];
    return {leaf.x[slot % fanout], leaf.y[slot % fanout], leaf.z[slot % fanout]};
  }

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

  /// Kernels::add_depths for the indexed points, seen from a camera at T_sensor_reference.
  void add_depths(const RigidTransform& T_sensor_reference, const CellRaster& raster,
                  CellTally* tallies) const noexcept {
    kernels_.add_depths(leaves_.data(), (size_ + fanout - 1) / fanout, T_sensor_reference.data(), raster, tallies);
  }

 private:
  struct Cell {
    std::uint32_t points;  // how many, while they are counted; 0 otherwise
    std::uint32_t next;    // of an occupied one: where its next point goes, at last the end of its points
  };
  void count_runs(std::span<const Point> points, PointTally& tally) noexcept;
  void lay_out() noexcept;
  void move_points(std::size_t count) noexcept;
  void enclose() noexcept;

  const Kernels& kernels_;
  CellGrid grid_;
  std::uint32_t size_ = 0;
  std::vector<PlacedPoint> placed_;  // per point of the frame: reference coordinates
  std::vector<std::uint32_t> rank_;  // and the rank of its cell
  // Runs: points that follow each other in the frame and lie in one cell.
  std::size_t run_count_ = 0;
  std::vector<std::uint32_t> run_begin_;       // place in the frame; the last one's end is the next one's begin
  std::vector<std::uint32_t> run_shift_;       // place after sorting less place in the frame, modulo 2^32
  std::vector<Cell> cells_;                    // per rank
  std::vector<std::uint64_t> occupied_;        // bit per rank
  std::vector<Leaf> leaves_;                   // while they are being filled the bytes of 16 sorted points each
  std::vector<std::vector<BoxGroup>> levels_;  // [0]: the leaves' boxes
  CloudTree tree_{};
};

}  // namespace lbea
