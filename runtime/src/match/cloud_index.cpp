#include "runtime/src/match/cloud_index.hpp"

#include "runtime/src/numbers/elementary.hpp"

#include <cstring>

namespace lbea {
namespace {
constexpr std::size_t most_octants = 1 << 20;  // an index needs eight bytes for each
// Relative to a cell. From a vertex farther away than a few cells, points nearer to each other are equally distant in
// floats.
constexpr float resolution_per_cell = 0x1p-22f;

// Moves the low 16 bits to every third bit, for a Morton key.
constexpr std::uint64_t spread(std::uint64_t bits) noexcept {
  std::uint64_t result = 0;
  for (unsigned bit = 0; bit < 16; ++bit) result |= (bits >> bit & 1u) << (3 * bit);
  return result;
}

// Ranks the cells with holds(cell) along the Morton curve.
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
  grid.rank.assign(count + 1, CellGrid::outside);  // one more, for positions outside
  grid.halvings = curve.size() <= most_octants / 8 ? 1 : 0;
  for (const auto& [key, place] : curve) {
    grid.rank[place] = grid.ranks;
    grid.ranks += 1u << (3 * grid.halvings);
  }
}

constexpr std::size_t groups_of(std::size_t count) noexcept {
  return (count + CloudIndex::fanout - 1) / CloudIndex::fanout;
}

void count_outside(std::span<const Point> points, PointTally& tally) noexcept {
  for (const Point& p : points)
    ++(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? tally.culled : tally.invalid);
}

constexpr std::uint32_t least_limit = 128, limits_per_cloud = 1024;
constexpr std::uint32_t least_range = 96;                  // fewer points cost less in a search than ordered
constexpr std::uint32_t least_parts = 8, most_parts = 64;  // per axis and pass
constexpr std::uint32_t cells_per_point = 4;               // of a grid that divides a range, at most
constexpr std::size_t most_passes = 3;                     // on average over the points of a cloud
constexpr float least_resolution = 1e-30f;                 // keeps its inverse finite

constexpr auto spread_parts = [] {
  std::array<std::uint32_t, most_parts> spread_numbers{};
  for (std::uint32_t i = 0; i < most_parts; ++i) spread_numbers[i] = static_cast<std::uint32_t>(spread(i));
  return spread_numbers;
}();

constexpr std::size_t cube(std::size_t edge) noexcept { return edge * edge * edge; }

std::uint32_t parts_for(std::size_t count) noexcept {
  std::uint32_t parts = least_parts;
  while (parts < most_parts && cube(2 * parts) <= cells_per_point * count) parts *= 2;
  return parts;
}

// x, y, z, 0.
typedef float Four __attribute__((vector_size(16)));
typedef std::int32_t FourInts __attribute__((vector_size(16)));

Four point_at(const std::byte* points, std::size_t i) noexcept {
  static_assert(sizeof(PlacedPoint) == sizeof(Four));
  FourInts point;
  std::memcpy(&point, points + i * sizeof(point), sizeof(point));
  return reinterpret_cast<Four>(point &
                                FourInts{-1, -1, -1, 0});  // the place in the frame: as a float, a slow denormal
}

struct Box {
  Four low, high;

  [[nodiscard]] float extent() const noexcept {
    const Four extents = high - low;
    return std::max({extents[0], extents[1], extents[2]});
  }
};

Box united(const Box& a, const Box& b) noexcept {
  return {a.low < b.low ? a.low : b.low, a.high > b.high ? a.high : b.high};
}

Box box_of(const std::byte* points, std::size_t count) noexcept {
  const auto at = [&](std::size_t i) { return Box{point_at(points, i), point_at(points, i)}; };
  Box even = at(0), odd = at(count - 1);  // two, so that no minimum waits for the previous point
  for (std::size_t i = 0; i + 1 < count; i += 2) {
    even = united(even, at(i));
    odd = united(odd, at(i + 1));
  }
  return united(even, odd);
}
}  // namespace

[[gnu::cold]]  // compiled for size
CellGrid
envelope_grid(const EnvelopeView& envelope) {
  CellGrid grid;
  grid.corner = envelope.corner;
  grid.cells_per_length = 1.0f / envelope.cell;
  grid.cells = envelope.cells;
  rank_cells(grid, [&](std::size_t cell) { return (envelope.bits[cell / 64] >> (cell % 64) & 1u) != 0; });
  return grid;
}

[[gnu::cold]]  // compiled for size
CellGrid
bounding_grid(std::span<const std::array<float, 3>> positions, std::uint32_t cell_count) {
  CellGrid grid;
  std::array<float, 3> low{}, high{};
  for (std::size_t axis = 0; axis < 3 && !positions.empty(); ++axis) {
    const auto [nearest, farthest] = std::ranges::minmax(positions, {}, [axis](const auto& p) { return p[axis]; });
    low[axis] = nearest[axis];
    high[axis] = farthest[axis];
  }
  // Flat clouds and equal points need a volume too: the edge of a cell stays well above the rounding of coordinates,
  // and every axis counts for at least a hundredth of the longest one.
  constexpr float least_relative = 1e-3f, least = 1e-6f;
  float longest = least;
  for (std::size_t axis = 0; axis < 3; ++axis)
    longest = std::max(
        {longest, high[axis] - low[axis], least_relative * std::abs(low[axis]), least_relative * std::abs(high[axis])});
  float volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) volume *= std::max((high[axis] - low[axis]) / longest, 0.01f);
  const float edge = longest * cube_root(volume / static_cast<float>(cell_count));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Half a cell of margin on both sides.
    grid.cells[axis] = static_cast<std::uint32_t>((high[axis] - low[axis]) / edge) + 2;
    grid.corner[axis] = low[axis] - 0.5f * edge;
  }
  grid.cells_per_length = 1.0f / edge;
  rank_cells(grid, [](std::size_t) { return true; });
  return grid;
}

CrowdedCells::CrowdedCells(std::uint32_t max_points) : ends_(cube(parts_for(max_points))) {
  ranges_.reserve((most_passes + 1) * (max_points / least_range));
}

std::uint32_t CrowdedCells::limit(std::size_t points) noexcept {
  return std::max(least_limit, static_cast<std::uint32_t>(points / limits_per_cloud));
}

void CrowdedCells::sort(std::span<std::byte> points, PlacedPoint* spare, std::uint32_t* keys,
                        float resolution) noexcept {
  const std::size_t count = points.size() / sizeof(PlacedPoint);
  std::size_t work = most_passes * count;
  for (std::size_t next = 0; next < ranges_.size(); ++next) {  // divide() adds ranges
    const Range range = ranges_[next];
    if (range.count <= least_range) continue;
    if (range.count > work) return;
    work -= range.count;
    divide(points.data() + range.begin * sizeof(PlacedPoint), range, spare, keys,
           std::max(resolution, least_resolution));
  }
}

// A counting sort by the cells of a grid over the box of the points.
void CrowdedCells::divide(std::byte* points, Range range, PlacedPoint* spare, std::uint32_t* keys,
                          float resolution) noexcept {
  const Box box = box_of(points, range.count);
  if (!(box.extent() > resolution)) return;
  const std::uint32_t parts = parts_for(range.count);
  const float scale = static_cast<float>(parts) / box.extent();
  const std::span ends = std::span(ends_).first(cube(parts));
  const FourInts last = FourInts{} + static_cast<std::int32_t>(parts - 1);
  std::ranges::fill(ends, 0u);
  for (std::size_t i = 0; i < range.count; ++i) {
    const FourInts along = __builtin_convertvector((point_at(points, i) - box.low) * scale, FourInts);
    const FourInts part = along < last ? along : last;
    const auto bits = [&](std::size_t axis) { return spread_parts[static_cast<std::uint32_t>(part[axis])]; };
    keys[i] = bits(0) | bits(1) << 1 | bits(2) << 2;
    ++ends[keys[i]];
  }
  std::uint32_t begin = 0;
  for (std::uint32_t& end : ends) {
    if (end > least_range) add(range.begin + begin, end);
    begin += std::exchange(end, begin);
  }
  for (std::size_t i = 0; i < range.count; ++i)
    std::memcpy(&spare[ends[keys[i]]++], points + i * sizeof(PlacedPoint), sizeof(PlacedPoint));
  std::memcpy(points, spare, range.count * sizeof(PlacedPoint));
}

[[gnu::cold]]  // compiled for size
CloudIndex::CloudIndex(CellGrid grid, std::uint32_t max_points, const Kernels& code)
    : kernels_(code),
      grid_(std::move(grid)),
      placed_(groups_of(max_points) * fanout),
      rank_(placed_.size() + fanout),
      run_begin_(std::size_t{max_points} + fanout + 1),
      run_shift_(max_points),
      cells_(grid_.ranks),
      occupied_((grid_.ranks + 63) / 64),
      leaves_(groups_of(max_points)),
      crowded_(max_points) {
  for (std::size_t boxes = leaves_.size(); levels_.empty() || boxes > 1; boxes = groups_of(boxes)) {
    levels_.emplace_back(groups_of(boxes));
    first_.emplace_back(groups_of(boxes) * fanout);
  }
  tree_.leaves = leaves_.data();
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    tree_.groups[level] = levels_[level].data();
    tree_.first[level] = first_[level].data();
  }
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
  assign_places(points.size());
  move_points(points.size());
  order_crowded_cells();
  enclose();
  tally.used = size_;
  return tally;
}

// A counting sort by cell, run by run: consecutive points are mostly in the same cell, and incrementing one counter
// point by point would be a chain of dependent additions. The end of a run is hard to predict, so no loop branches on
// it.
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

// Replaces the number of points of each cell by the place of its first point, along the curve.
void CloudIndex::assign_places(std::size_t received) noexcept {
  const std::uint32_t limit = CrowdedCells::limit(received);
  crowded_.clear();
  size_ = 0;
  for (std::size_t word = 0; word < occupied_.size(); ++word)
    for (std::uint64_t bits = occupied_[word]; bits != 0; bits &= bits - 1) {
      Cell& cell = cells_[word * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
      cell.next = size_;
      if (cell.points > limit) crowded_.add(size_, cell.points);
      size_ += std::exchange(cell.points, 0u);
    }
}

// Stable: the points of a cell keep the frame's order. Points outside go behind all others, where no search reads.
void CloudIndex::move_points(std::size_t count) noexcept {
  for (std::size_t run = 0; run < run_count_; ++run) {
    const std::uint32_t begin = run_begin_[run], rank = rank_[begin];
    const bool is_inside = rank != CellGrid::outside;
    run_shift_[run] = (is_inside ? cells_[rank].next : size_) - begin;
    if (is_inside) cells_[rank].next += run_begin_[run + 1] - begin;
  }
  std::size_t run = 0;
  std::uint32_t rank = count > 0 ? rank_[0] : 0;
  const std::uint32_t* const ranks = rank_.data();  // byte stores may alias the vectors, so the pointers are hoisted
  const PlacedPoint* const placed = placed_.data();
  const std::uint32_t* const shift = run_shift_.data();
  auto* const sorted = reinterpret_cast<std::byte*>(leaves_.data());
  for (std::uint32_t i = 0; i < count; ++i) {
    run += static_cast<std::size_t>(ranks[i] != rank);
    rank = ranks[i];
    std::memcpy(sorted + std::size_t{i + shift[run]} * sizeof(PlacedPoint), &placed[i], sizeof(PlacedPoint));
  }
}

// The points before sorting, and their ranks, are not needed any more.
void CloudIndex::order_crowded_cells() noexcept {
  const auto sorted = std::as_writable_bytes(std::span(leaves_)).first(size_ * sizeof(PlacedPoint));
  crowded_.sort(sorted, placed_.data(), rank_.data(), resolution_per_cell / grid_.cells_per_length);
}

// The last point of the position's cell or, when that is empty, of one of the 64 cells around it on the curve.
std::uint32_t CloudIndex::hint(const std::array<float, 3>& position) const noexcept {
  const std::uint32_t rank = grid_.rank_of(position);
  if (rank == CellGrid::outside || occupied_[rank / 64] == 0) return NearestPoint::none;
  const std::uint64_t own_first = std::rotr(occupied_[rank / 64], static_cast<int>(rank % 64));
  const auto steps = static_cast<std::uint32_t>(std::countr_zero(own_first));
  return cells_[rank - rank % 64 + (rank + steps) % 64].next - 1;
}

std::size_t CloudIndex::find_around(const std::array<float, 3>& position,
                                    std::array<const Leaf*, 8>& leaves) const noexcept {
  std::array<std::uint32_t, 3> first;  // octants, or cells that have none
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float along =
        (position[axis] - grid_.corner[axis]) * grid_.cells_per_length * static_cast<float>(1u << grid_.halvings) -
        0.5f;
    if (!(along >= 0 && along < static_cast<float>((grid_.cells[axis] << grid_.halvings) - 1))) return 0;
    first[axis] = static_cast<std::uint32_t>(along);
  }
  const unsigned halvings = grid_.halvings;
  const std::size_t columns = grid_.cells[0], rows = grid_.cells[1];
  std::array<std::uint32_t, 8> ranks;  // of occupied cells. In a loop of its own, no load waits for another
  std::size_t occupied = 0, count = 0;
  for (std::uint32_t corner = 0; corner < ranks.size(); ++corner) {
    const std::uint32_t x = first[0] + (corner & 1u), y = first[1] + (corner >> 1 & 1u), z = first[2] + (corner >> 2);
    const std::uint32_t of_cell = grid_.rank[(x >> halvings) + columns * ((y >> halvings) + rows * (z >> halvings))];
    const std::uint32_t rank = of_cell | (x & halvings) | (y & halvings) << 1 | (z & halvings) << 2;
    const std::uint32_t known = of_cell == CellGrid::outside ? 0 : rank;
    ranks[occupied] = rank;
    occupied += static_cast<std::size_t>(of_cell != CellGrid::outside) & (occupied_[known / 64] >> (known % 64));
  }
  for (std::size_t i = 0; i < occupied; ++i) {
    const Leaf* const leaf = &leaves_[(cells_[ranks[i]].next - 1) / fanout];
    if (std::find(leaves.begin(), leaves.begin() + count, leaf) == leaves.begin() + count) leaves[count++] = leaf;
  }
  return count;
}

void CloudIndex::enclose() noexcept {
  kernels_.fill_leaves(size_, leaves_.data(), levels_[0].data());
  std::size_t boxes = groups_of(size_);
  for (tree_.top = 0; boxes > fanout; ++tree_.top, boxes = groups_of(boxes))
    kernels_.enclose(levels_[tree_.top].data(), boxes, levels_[tree_.top + 1].data());
  tree_.is_crowded = !crowded_.empty();
  if (tree_.is_crowded) find_first_places();
}

void CloudIndex::find_first_places() noexcept {
  const std::size_t leaves = groups_of(size_);
  std::ranges::fill(first_[0], NearestPoint::none);
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) first_[0][leaf] = std::ranges::min(leaves_[leaf].point);
  for (std::size_t level = 1; level <= tree_.top; ++level)
    for (std::size_t box = 0; box < first_[level].size(); ++box)
      first_[level][box] = box * fanout < first_[level - 1].size()
                               ? std::ranges::min(std::span(first_[level - 1]).subspan(box * fanout, fanout))
                               : NearestPoint::none;
}
}  // namespace lbea
