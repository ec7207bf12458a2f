#include "runtime/src/cloud_index.hpp"

#include "runtime/src/transform.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

constexpr std::size_t groups_of(std::size_t count) noexcept { return (count + CloudIndex::fanout - 1) / CloudIndex::fanout; }

}  // namespace

CloudIndex::CloudIndex(CellGrid grid, std::uint32_t max_points)
    : grid_(std::move(grid)), rank_(max_points), next_(std::size_t{grid_.ranks} + 1), point_(groups_of(max_points) * fanout) {
  for (auto& coordinate : xyz_) coordinate.resize(point_.size());
  std::size_t boxes = groups_of(max_points);
  do {
    Boxes& level = levels_.emplace_back();
    for (auto* corner : {&level.low, &level.high})
      for (auto& coordinate : *corner) coordinate.resize(groups_of(boxes) * fanout);
    boxes = groups_of(boxes);
  } while (boxes > 1);
}

PointTally CloudIndex::build(std::span<const Point> points, const RigidTransform& T) noexcept {
  const PointTally tally = place(points, T);
  sort(points, T);
  enclose();
  return tally;
}

// Which cell each point lies in, and how many points each cell gets.
PointTally CloudIndex::place(std::span<const Point> points, const RigidTransform& T) noexcept {
  PointTally tally{.received = static_cast<std::uint32_t>(points.size())};
  std::ranges::fill(next_, 0u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [x, y, z] = apply(T, points[i]);
    const std::uint32_t rank = grid_.rank_of(x, y, z);
    rank_[i] = rank;
    if (rank != CellGrid::outside) {
      ++next_[rank + 1];
      ++tally.used;
    } else if (std::isfinite(points[i].x) && std::isfinite(points[i].y) && std::isfinite(points[i].z)) {
      ++tally.culled;
    } else {
      ++tally.invalid;
    }
  }
  size_ = tally.used;
  return tally;
}

// Counting sort by cell: stable, so points of one cell keep the frame's order.
void CloudIndex::sort(std::span<const Point> points, const RigidTransform& T) noexcept {
  for (std::size_t rank = 1; rank < next_.size(); ++rank) next_[rank] += next_[rank - 1];
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (rank_[i] == CellGrid::outside) continue;
    const std::uint32_t to = next_[rank_[i]]++;
    const auto position = apply(T, points[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) xyz_[axis][to] = position[axis];
    point_[to] = static_cast<std::uint32_t>(i);
  }
  for (std::size_t pad = size_; pad < groups_of(size_) * fanout; ++pad) {
    for (auto& coordinate : xyz_) coordinate[pad] = infinity;
    point_[pad] = NearestPoint::none;
  }
}

void CloudIndex::enclose() noexcept {
  enclose_points();
  for (top_ = 0; levels_[top_].count > fanout; ++top_) enclose_boxes(levels_[top_], levels_[top_ + 1]);
}

void CloudIndex::enclose_points() noexcept {
  Boxes& leaves = levels_[0];
  leaves.count = groups_of(size_);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t leaf = 0; leaf < leaves.count; ++leaf) {
      const std::size_t begin = leaf * fanout, end = std::min<std::size_t>(begin + fanout, size_);
      const auto [least, most] = std::ranges::minmax(std::span(xyz_[axis]).subspan(begin, end - begin));
      leaves.low[axis][leaf] = least;
      leaves.high[axis][leaf] = most;
    }
    for (std::size_t pad = leaves.count; pad < groups_of(leaves.count) * fanout; ++pad) {
      leaves.low[axis][pad] = infinity;
      leaves.high[axis][pad] = -infinity;
    }
  }
}

void CloudIndex::enclose_boxes(const Boxes& children, Boxes& parents) noexcept {
  parents.count = groups_of(children.count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t parent = 0; parent < groups_of(parents.count) * fanout; ++parent) {
      float low = infinity, high = -infinity;
      const std::size_t begin = parent * fanout, end = std::min(begin + fanout, children.count);
      for (std::size_t child = begin; child < end; ++child) {
        low = std::min(low, children.low[axis][child]);
        high = std::max(high, children.high[axis][child]);
      }
      parents.low[axis][parent] = low;
      parents.high[axis][parent] = high;
    }
  }
}

NearestPoint CloudIndex::nearest(const std::array<float, 3>& query, NearestPoint bound) const noexcept {
  if (size_ > 0) search_group(top_, 0, query, bound);
  return bound;
}

void CloudIndex::search_group(std::size_t level, std::size_t group, const std::array<float, 3>& query,
                              NearestPoint& best) const noexcept {
  const Boxes& boxes = levels_[level];
  const std::size_t first = group * fanout;
  std::array<float, fanout> squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* low = boxes.low[axis].data() + first;
    const float* high = boxes.high[axis].data() + first;
    for (std::size_t i = 0; i < fanout; ++i) {
      const float outside = std::max(std::max(low[i] - query[axis], query[axis] - high[i]), 0.0f);
      squared[i] += outside * outside;
    }
  }
  for (;;) {  // nearest box first; a box at the bound may still hold an equally near point of lower place
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < fanout; ++i)
      if (squared[i] < squared[nearest]) nearest = i;
    if (squared[nearest] > best.squared || squared[nearest] == infinity) return;
    squared[nearest] = infinity;
    if (level == 0)
      search_leaf(first + nearest, query, best);
    else
      search_group(level - 1, first + nearest, query, best);
  }
}

void CloudIndex::search_leaf(std::size_t leaf, const std::array<float, 3>& query, NearestPoint& best) const noexcept {
  const std::size_t first = leaf * fanout;
  std::array<float, fanout> squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* coordinate = xyz_[axis].data() + first;
    for (std::size_t i = 0; i < fanout; ++i) {
      const float difference = coordinate[i] - query[axis];
      squared[i] += difference * difference;
    }
  }
  for (std::size_t i = 0; i < fanout; ++i) {
    const std::size_t place = first + i;
    if (squared[i] > best.squared || (squared[i] == best.squared && point_[place] >= best.point)) continue;
    best = {point_[place], squared[i], xyz_[0][place], xyz_[1][place], xyz_[2][place]};
  }
}

}  // namespace lbea
