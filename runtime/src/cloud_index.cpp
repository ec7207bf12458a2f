#include "runtime/src/cloud_index.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {

namespace {

constexpr std::size_t groups_of(std::size_t count) noexcept { return (count + CloudIndex::fanout - 1) / CloudIndex::fanout; }

}  // namespace

CloudIndex::CloudIndex(CellGrid grid, std::uint32_t max_points, const Kernels& code)
    : kernels_(code), grid_(std::move(grid)), rank_(groups_of(max_points) * fanout), next_(std::size_t{grid_.ranks} + 1),
      sorted_(max_points), leaves_(groups_of(max_points)) {
  for (auto& coordinate : xyz_) coordinate.resize(rank_.size());
  for (std::size_t boxes = leaves_.size(); levels_.empty() || boxes > 1; boxes = groups_of(boxes))
    levels_.emplace_back(groups_of(boxes));
  tree_.leaves = leaves_.data();
  for (std::size_t level = 0; level < levels_.size(); ++level) tree_.groups[level] = levels_[level].data();
}

PointTally CloudIndex::build(std::span<const Point> points, const RigidTransform& T) noexcept {
  const GridView grid{{grid_.corner[0], grid_.corner[1], grid_.corner[2]}, grid_.cells_per_length,
                      {grid_.cells[0], grid_.cells[1], grid_.cells[2]}, grid_.rank.data()};
  float* const xyz[3] = {xyz_[0].data(), xyz_[1].data(), xyz_[2].data()};
  const float* coordinates = points.empty() ? nullptr : &points.front().x;
  kernels_.place(coordinates, points.size(), T.data(), grid, xyz, rank_.data());
  sort(points.size());
  enclose();
  return tally(points);
}

PointTally CloudIndex::tally(std::span<const Point> points) const noexcept {
  PointTally tally{.received = static_cast<std::uint32_t>(points.size()), .used = size_};
  if (tally.used == tally.received) return tally;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (rank_[i] != CellGrid::outside) continue;
    const bool finite = std::isfinite(points[i].x) && std::isfinite(points[i].y) && std::isfinite(points[i].z);
    ++(finite ? tally.culled : tally.invalid);
  }
  return tally;
}

// Counting sort by cell: stable, so points of one cell keep the frame's order.
void CloudIndex::sort(std::size_t count) noexcept {
  std::ranges::fill(next_, 0u);
  for (std::size_t i = 0; i < count; ++i)
    if (rank_[i] != CellGrid::outside) ++next_[rank_[i] + 1];
  for (std::size_t rank = 1; rank < next_.size(); ++rank) next_[rank] += next_[rank - 1];
  size_ = next_.back();
  for (std::size_t i = 0; i < count; ++i)
    if (rank_[i] != CellGrid::outside)
      sorted_[next_[rank_[i]]++] = {xyz_[0][i], xyz_[1][i], xyz_[2][i], static_cast<std::uint32_t>(i)};
}

// The last point of the cell or, when it is empty, of the last cell before it on the curve that is not.
std::uint32_t CloudIndex::hint(const std::array<float, 3>& position) const noexcept {
  const std::uint32_t rank = grid_.rank_of(position);
  if (rank == CellGrid::outside || size_ == 0) return NearestPoint::none;
  return next_[rank] == 0 ? 0 : next_[rank] - 1;
}

void CloudIndex::enclose() noexcept {
  kernels_.fill_leaves(sorted_.data(), size_, leaves_.data(), levels_[0].data());
  std::size_t boxes = groups_of(size_);
  for (tree_.top = 0; boxes > fanout; ++tree_.top, boxes = groups_of(boxes))
    kernels_.enclose(levels_[tree_.top].data(), boxes, levels_[tree_.top + 1].data());
}

}  // namespace lbea
