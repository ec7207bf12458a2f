// An index over one fresh cloud: the points in Morton order, in leaves of 16, under a 16-ary tree of boxes.
#pragma once

#include "runtime/src/cell_grid.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lbea {

/// A point of the cloud as seen from a query position.
struct NearestPoint {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t point = none;  // its place in the frame
  float squared = std::numeric_limits<float>::infinity();
  float x = 0, y = 0, z = 0;  // reference coordinates
};

class CloudIndex {
 public:
  static constexpr std::size_t fanout = 16;

  /// All memory is allocated here, for clouds of up to `max_points`.
  CloudIndex(CellGrid grid, std::uint32_t max_points);

  /// Brings the points into reference coordinates, drops those outside the grid and indexes the rest.
  /// `points` may not be more than max_points. Linear in their number; no allocation.
  PointTally build(std::span<const Point> points, const RigidTransform& T_reference_sensor) noexcept;

  /// The exact nearest point among those with squared distance <= bound.squared; `bound` itself when none
  /// is nearer. Equal distances go to the lower place in the frame.
  [[nodiscard]] NearestPoint nearest(const std::array<float, 3>& query, NearestPoint bound) const noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

 private:
  struct Boxes {  // one level of the tree; padded with empty boxes to whole groups
    std::array<std::vector<float>, 3> low, high;
    std::size_t count = 0;
  };

  PointTally place(std::span<const Point> points, const RigidTransform& T) noexcept;
  void sort(std::span<const Point> points, const RigidTransform& T) noexcept;
  void enclose() noexcept;
  void enclose_points() noexcept;
  void enclose_boxes(const Boxes& children, Boxes& parents) noexcept;
  void search_group(std::size_t level, std::size_t group, const std::array<float, 3>& query, NearestPoint& best) const noexcept;
  void search_leaf(std::size_t leaf, const std::array<float, 3>& query, NearestPoint& best) const noexcept;

  CellGrid grid_;
  std::uint32_t size_ = 0;
  std::vector<std::uint32_t> rank_;         // per point of the frame
  std::vector<std::uint32_t> next_;         // per rank: where its next point goes
  std::array<std::vector<float>, 3> xyz_;   // sorted, reference coordinates, padded to whole leaves
  std::vector<std::uint32_t> point_;        // sorted: place in the frame
  std::vector<Boxes> levels_;               // [0]: one box per leaf
  std::size_t top_ = 0;                     // the level whose boxes form a single group
};

}  // namespace lbea
