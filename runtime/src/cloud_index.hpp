// An index over one fresh cloud: the points in Morton order, in leaves of 16, under a 16-ary tree of boxes.
#pragma once

#include "runtime/src/cell_grid.hpp"
#include "runtime/src/kernels.hpp"

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
  /// `points` may not be more than max_points. Linear in their number; no allocation.
  PointTally build(std::span<const Point> points, const RigidTransform& T_reference_sensor) noexcept;

  /// The exact nearest point among those with squared distance <= bound.squared; `bound` itself when none
  /// is nearer. Equal distances go to the lower place in the frame.
  [[nodiscard]] NearestPoint nearest(const std::array<float, 3>& query, NearestPoint bound) const noexcept {
    return size_ > 0 ? kernels_.nearest(tree_, query.data(), bound) : bound;
  }

  /// A slot with a point that is probably near to `position`; none when it lies outside the grid or the cloud is empty.
  [[nodiscard]] std::uint32_t hint(const std::array<float, 3>& position) const noexcept;
  /// The same as nearest() for 16 queries near each other (x, y, z planes), with a hint for each.
  void nearest_16(const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) const noexcept {
    if (size_ > 0) kernels_.nearest_16(tree_, queries, hints, best);
  }
  /// Whether there is any point within the bound: best.point says, and is not the nearest.
  void any_16(const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) const noexcept {
    if (size_ > 0) kernels_.any_16(tree_, queries, hints, best);
  }
  /// Reference coordinates of the point in a slot that a search has named.
  [[nodiscard]] std::array<float, 3> position(std::uint32_t slot) const noexcept {
    const Leaf& leaf = leaves_[slot / fanout];
    return {leaf.x[slot % fanout], leaf.y[slot % fanout], leaf.z[slot % fanout]};
  }

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

  /// Kernels::add_depths for the indexed points, seen from a camera at T_sensor_reference.
  void add_depths(const RigidTransform& T_sensor_reference, const CellRaster& raster, CellTally* tallies) const noexcept {
    kernels_.add_depths(leaves_.data(), (size_ + fanout - 1) / fanout, T_sensor_reference.data(), raster, tallies);
  }

 private:
  [[nodiscard]] PointTally tally(std::span<const Point> points) const noexcept;
  void sort(std::size_t count) noexcept;
  void enclose() noexcept;

  const Kernels& kernels_;
  CellGrid grid_;
  std::uint32_t size_ = 0;
  std::array<std::vector<float>, 3> xyz_;  // per point of the frame: reference coordinates
  std::vector<std::uint32_t> rank_;        // and the rank of its cell
  std::vector<std::uint32_t> next_;        // per rank: where its next point goes
  std::vector<PlacedPoint> sorted_;
  std::vector<Leaf> leaves_;
  std::vector<std::vector<BoxGroup>> levels_;  // [0]: the leaves' boxes
  CloudTree tree_{};
};

}  // namespace lbea
