#include "runtime/src/match/cloud_index.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

namespace lbea {
namespace {

constexpr std::size_t groups_of(std::size_t count) noexcept {
  return (count + CloudIndex::fanout - 1) / CloudIndex::fanout;
}

void count_outside(std::span<const Point> points, PointTally& tally) noexcept {
  for (const Point& p : points)
    ++(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? tally.culled : tally.invalid);
}

}  // namespace

CloudIndex::CloudIndex(CellGrid grid, std::uint32_t max_points, const Kernels& code)
    : kernels_(code),
      grid_(std::move(grid)),
      placed_(groups_of(max_points) * fanout),
      rank_(placed_.size() + fanout),
      run_begin_(std::size_t{max_points} + fanout + 1),
      run_shift_(max_points),
      cells_(grid_.ranks),
      occupied_((grid_.ranks + 63) / 64),
      leaves_(groups_of(max_points)) {
  for (std::size_t boxes = leaves_.size(); levels_.empty() || boxes > 1; boxes = groups_of(boxes))
    levels_.emplace_back(groups_of(boxes));
  tree_.leaves = leaves_.data();
  for (std::size_t level = 0; level < levels_.size(); ++level) tree_.groups[level] = levels_[level].data();
}

PointTally CloudIndex::build(std::span<const Point> points, const RigidTransform& T) noexcept {
  const GridView grid{{grid_.corner[0], grid_.corner[1], grid_.corner[2]},
                      grid_.cells_per_length,
                      {grid_.cells[0], grid_.cells[1], grid_.cells[2]},
                      grid_.halvings,
                      grid_.rank.data()};
  const float* coordinates = points.empty() ? nullptr : &points.front().x;
  PointTally tally{.received = static_cast<std::uint32_t>(points.size())};
  kernels_.place(coordinates, points.size(), T.data(), grid, placed_.data(), rank_.data());
  run_count_ = kernels_.find_runs(rank_.data(), points.size(), run_begin_.data());
  count_runs(points, tally);
  lay_out();
  move_points(points.size());
  enclose();
  tally.used = size_;
  return tally;
}

// A counting sort by cell, but by runs: neighbours in a frame mostly fall into the same cell, and a count that is
// raised point by point waits for itself. Where a run ends is hard to foretell: these loops do not branch on it.
void CloudIndex::count_runs(std::span<const Point> points, PointTally& tally) noexcept {
  std::ranges::fill(occupied_, 0u);
  for (std::size_t run = 0; run < run_count_; ++run) {
    const std::uint32_t begin = run_begin_[run], end = run_begin_[run + 1], rank = rank_[begin];
    if (rank == CellGrid::outside) {
      count_outside(points.subspan(begin, end - begin), tally);
      continue;
    }
    cells_[rank].points += end - begin;
    occupied_[rank / 64] |= std::uint64_t{1} << (rank % 64);
  }
}

// From how many points each cell has to where its first one goes, along the curve.
void CloudIndex::lay_out() noexcept {
  size_ = 0;
  for (std::size_t word = 0; word < occupied_.size(); ++word)
    for (std::uint64_t bits = occupied_[word]; bits != 0; bits &= bits - 1) {
      Cell& cell = cells_[word * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
      cell.next = size_;
      size_ += std::exchange(cell.points, 0u);
    }
}

// Stable: points of one cell keep the frame's order. Those outside go behind all others, where nobody looks.
void CloudIndex::move_points(std::size_t count) noexcept {
  for (std::size_t run = 0; run < run_count_; ++run) {
    const std::uint32_t begin = run_begin_[run], rank = rank_[begin];
    const bool is_inside = rank != CellGrid::outside;
    run_shift_[run] = (is_inside ? cells_[rank].next : size_) - begin;
    if (is_inside) cells_[rank].next += run_begin_[run + 1] - begin;
  }
  std::size_t run = 0;
  std::uint32_t rank = count > 0 ? rank_[0] : 0;
  const std::uint32_t* const ranks = rank_.data();  // whoever writes bytes may have written the vectors themselves
  const PlacedPoint* const placed = placed_.data();
  const std::uint32_t* const shift = run_shift_.data();
  auto* const sorted = reinterpret_cast<std::byte*>(leaves_.data());
  for (std::uint32_t i = 0; i < count; ++i) {
    run += static_cast<std::size_t>(ranks[i] != rank);
    rank = ranks[i];
    std::memcpy(sorted + std::size_t{i + shift[run]} * sizeof(PlacedPoint), &placed[i], sizeof(PlacedPoint));
  }
}

// The last point of the position's cell or, when it is empty, of one of the 64 about it on the curve.
std::uint32_t CloudIndex::hint(const std::array<float, 3>& position) const noexcept {
  const std::uint32_t rank = grid_.rank_of(position);
  if (rank == CellGrid::outside || occupied_[rank / 64] == 0) return NearestPoint::none;
  const std::uint64_t own_first = std::rotr(occupied_[rank / 64], static_cast<int>(rank % 64));
  const auto steps = static_cast<std::uint32_t>(std::countr_zero(own_first));
  return cells_[rank - rank % 64 + (rank + steps) % 64].next - 1;
}

void CloudIndex::enclose() noexcept {
  kernels_.fill_leaves(size_, leaves_.data(), levels_[0].data());
  std::size_t boxes = groups_of(size_);
  for (tree_.top = 0; boxes > fanout; ++tree_.top, boxes = groups_of(boxes))
    kernels_.enclose(levels_[tree_.top].data(), boxes, levels_[tree_.top + 1].data());
}

}  // namespace lbea
