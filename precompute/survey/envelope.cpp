#include "precompute/survey/envelope.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace lbea::bake {
/// 4 x 4 x 4 cells as the bits of a word: x + 4 y + 16 z from the first one.
struct CellBlock {
  /// The cells with the same x, the same y and the same z as a position.
  struct Planes {
    std::uint64_t x, y, z;
  };

  /// Begins at the cell that contains `low`, which is not negative; in cells.
  explicit CellBlock(const std::array<double, 3>& low) {
    for (std::size_t axis = 0; axis < 3; ++axis) first[axis] = static_cast<std::uint32_t>(low[axis]);
  }

  /// position: less than four cells beyond the first one.
  [[nodiscard]] Planes planes(const std::array<double, 3>& position) const {
    const auto along = [&](std::size_t axis) { return static_cast<std::uint32_t>(position[axis]) - first[axis]; };
    return {0x1111'1111'1111'1111u << along(0), 0x000f'000f'000f'000fu << (4 * along(1)),
            std::uint64_t{0xffff} << (16 * along(2))};
  }
  /// The bounding box of three corners, when it is not larger than a cell: then no cell lies between those of the
  /// corners.
  [[nodiscard]] static std::uint64_t box(const Planes& a, const Planes& b, const Planes& c) {
    return (a.x | b.x | c.x) & (a.y | b.y | c.y) & (a.z | b.z | c.z);
  }

  std::array<std::uint32_t, 3> first{};
};

namespace {
constexpr double most_cells = 1 << 17;   // about; the 16 KiB stay in the cache of the thread that culls points
constexpr double most_excess = 1.5;      // rounding up adds cells; flat and long boxes need larger cells for it
constexpr double coarser = 1.1;          // factor between tried edges of a cell
constexpr double margin_per_edge = 4;    // cells need not be finer than this
constexpr double rounding_slack = 0.01;  // cells; floats of the runtime may round a point into the next cell

std::size_t words(std::size_t bits) { return (bits + 63) / 64; }

/// The part of a convex polygon on one side of the plane where coordinate `axis` is `at`; its border belongs to it.
std::vector<std::array<double, 3>> clipped(const std::vector<std::array<double, 3>>& polygon, std::size_t axis,
                                           double at, double side) {
  std::vector<std::array<double, 3>> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double from = side * (p[axis] - at), to = side * (q[axis] - at);
    if (from >= 0) part.push_back(p);
    if (!(from < 0 && to > 0) && !(from > 0 && to < 0)) continue;
    auto& crossing = part.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) crossing[k] = p[k] + from / (from - to) * (q[k] - p[k]);
    crossing[axis] = at;
  }
  return part;
}

/// Less than a quarter as high as long: in quarters of its edges it would have many more pieces than its area has
/// cells.
bool is_thin(const std::array<double, 3>& a, const std::array<double, 3>& b, const std::array<double, 3>& c) {
  std::array<double, 3> ab{}, ac{};
  double longest = 0;  // squared edges
  for (std::size_t axis = 0; axis < 3; ++axis) ab[axis] = b[axis] - a[axis], ac[axis] = c[axis] - a[axis];
  const auto squared = [](double x, double y, double z) { return x * x + y * y + z * z; };
  longest = std::max({squared(ab[0], ab[1], ab[2]), squared(ac[0], ac[1], ac[2]),
                      squared(ab[0] - ac[0], ab[1] - ac[1], ab[2] - ac[2])});
  const double twice_area =
      std::sqrt(squared(ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]));
  return twice_area < longest / 4;
}

std::size_t index_of(const EnvelopeGrid& grid, std::size_t x, std::size_t y, std::size_t z) {
  return x + grid.cells[0] * (y + std::size_t{grid.cells[1]} * z);
}

bool test(const EnvelopeGrid& grid, std::size_t cell) { return (grid.bits[cell / 64] >> (cell % 64) & 1) != 0; }

/// How many cells along x come within `margin` of a cell this far away in y and z; -1: none. All in cells.
std::int64_t reach_along_x(std::int64_t y, std::int64_t z, double margin) {
  const auto gap = [](std::int64_t offset) {
    return static_cast<double>(std::max<std::int64_t>(std::abs(offset) - 1, 0));
  };
  std::int64_t x = -1;
  while (std::hypot(gap(x + 1), gap(y), gap(z)) <= margin) ++x;
  return x;
}

/// Offset of a row of cells in y and z, and how many cells along x the margin reaches there.
struct Neighbor {
  std::int64_t y, z;
  std::size_t x;
};

std::vector<Neighbor> neighbors(double margin) {
  const auto reach = static_cast<std::int64_t>(std::ceil(margin)) + 1;
  std::vector<Neighbor> rows;
  for (std::int64_t z = -reach; z <= reach; ++z)
    for (std::int64_t y = -reach; y <= reach; ++y)
      if (const std::int64_t x = reach_along_x(y, z, margin); x >= 0)
        rows.push_back({y, z, static_cast<std::size_t>(x)});
  return rows;
}

/// The cells of one y and z, starting at a word boundary.
using Row = std::vector<std::uint64_t>;

Row row_at(const EnvelopeGrid& grid, std::size_t begin) {
  Row row(words(grid.cells[0]));
  for (std::size_t x = 0; x < grid.cells[0]; ++x) row[x / 64] |= std::uint64_t{test(grid, begin + x)} << (x % 64);
  return row;
}

/// The marked cells and their neighbors along x.
Row widened(const Row& row) {
  Row wide = row;
  for (std::size_t i = 0; i < row.size(); ++i) {
    wide[i] |= row[i] << 1 | row[i] >> 1;
    if (i > 0) wide[i] |= row[i - 1] >> 63;
    if (i + 1 < row.size()) wide[i] |= row[i + 1] << 63;
  }
  return wide;
}

void mark_row(EnvelopeGrid& grid, std::size_t begin, const Row& row) {
  for (std::size_t x = 0; x < grid.cells[0]; ++x)
    grid.bits[(begin + x) / 64] |= (row[x / 64] >> (x % 64) & 1) << ((begin + x) % 64);
}
}  // namespace

bool EnvelopeGrid::contains(const std::array<float, 3>& point) const noexcept {
  std::array<std::size_t, 3> at{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cell = std::floor((double{point[axis]} - double{corner[axis]}) / double{edge});
    if (!(cell >= 0 && cell < cells[axis])) return false;
    at[axis] = static_cast<std::size_t>(cell);
  }
  return test(*this, index_of(*this, at[0], at[1], at[2]));
}

EnvelopeBuilder::EnvelopeBuilder(const std::array<float, 3>& min, const std::array<float, 3>& max, double margin) {
  double volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) volume *= double{max[axis]} - double{min[axis]} + 2 * margin;
  if (!(margin > 0 && volume > 0 && std::isfinite(volume)))
    throw Error(Status::bad_config, "the envelope margin must be positive and the positions finite; the margin is " +
                                        std::to_string(margin));
  double edge = std::max(margin / margin_per_edge, std::cbrt(volume / most_cells));
  while (lay_out(min, max, margin, edge) > most_excess * most_cells) edge *= coarser;
  surface_.bits.assign(words(surface_.count()), 0);
}

double EnvelopeBuilder::lay_out(const std::array<float, 3>& min, const std::array<float, 3>& max, double margin,
                                double wanted_edge) {
  surface_.edge = static_cast<float>(wanted_edge);
  const double edge = double{surface_.edge};
  margin_cells_ = margin / edge + rounding_slack;
  double count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double room = (margin_cells_ + rounding_slack) * edge;
    surface_.corner[axis] = static_cast<float>(double{min[axis]} - room);
    const double cells = std::max(std::ceil((double{max[axis]} + room - double{surface_.corner[axis]}) / edge), 1.0);
    count *= cells;
    surface_.cells[axis] = static_cast<std::uint32_t>(std::min(cells, most_excess * most_cells));
  }
  return count;
}

void EnvelopeBuilder::add(std::span<const float> positions, std::span<const Quad> elements) {
  std::vector<Corner> corners(positions.size() / 3);
  for (std::size_t node = 0; node < corners.size(); ++node)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double along = (double{positions[3 * node + axis]} - double{surface_.corner[axis]}) / double{surface_.edge};
      corners[node][axis] = along > 0 ? std::min(along, static_cast<double>(surface_.cells[axis]) - 0.5) : 0;
    }
  for (const auto& [a, b, c, d] : elements) {
    add_triangle(corners[a], corners[b], corners[c]);
    if (c != d) add_triangle(corners[a], corners[c], corners[d]);
  }
}

void EnvelopeBuilder::add(std::span<const std::uint64_t> bits) {
  for (std::size_t i = 0; i < std::min(bits.size(), surface_.bits.size()); ++i)
    std::atomic_ref<std::uint64_t>(surface_.bits[i]).fetch_or(bits[i], std::memory_order_relaxed);
}

// Quarters the triangle until it fits into a block; there it marks the bounding boxes of pieces no larger than a cell.
void EnvelopeBuilder::add_triangle(const Corner& a, const Corner& b, const Corner& c) {
  Corner low{}, ab{}, bc{}, ca{};
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::min({a[axis], b[axis], c[axis]});
    largest = std::max(largest, std::max({a[axis], b[axis], c[axis]}) - low[axis]);
    ab[axis] = (a[axis] + b[axis]) / 2;
    bc[axis] = (b[axis] + c[axis]) / 2;
    ca[axis] = (c[axis] + a[axis]) / 2;
  }
  if (largest > 2) {
    if (is_thin(a, b, c)) return add_polygon({a, b, c});
    add_triangle(a, ab, ca);
    add_triangle(ab, b, bc);
    add_triangle(ca, bc, c);
    return add_triangle(ab, bc, ca);
  }
  const CellBlock block(low);
  const CellBlock::Planes at_a = block.planes(a), at_b = block.planes(b), at_c = block.planes(c);
  if (largest <= 1) return mark(block, CellBlock::box(at_a, at_b, at_c));
  const CellBlock::Planes at_ab = block.planes(ab), at_bc = block.planes(bc), at_ca = block.planes(ca);
  mark(block, CellBlock::box(at_a, at_ab, at_ca) | CellBlock::box(at_ab, at_b, at_bc) |
                  CellBlock::box(at_ca, at_bc, at_c) | CellBlock::box(at_ab, at_bc, at_ca));
}

// Halves the polygon along its longest axis: the number of pieces follows its area and its length.
void EnvelopeBuilder::add_polygon(const std::vector<Corner>& polygon) {
  Corner low = polygon.front(), high = low;
  for (const Corner& corner : polygon)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], corner[axis]);
      high[axis] = std::max(high[axis], corner[axis]);
    }
  std::size_t longest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis)
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  if (high[longest] - low[longest] > 1) {
    const double middle = (low[longest] + high[longest]) / 2;
    add_polygon(clipped(polygon, longest, middle, -1));
    return add_polygon(clipped(polygon, longest, middle, 1));
  }
  const CellBlock block(low);
  CellBlock::Planes all{0, 0, 0};
  for (const Corner& corner : polygon) {
    const CellBlock::Planes at = block.planes(corner);
    all = {all.x | at.x, all.y | at.y, all.z | at.z};
  }
  mark(block, CellBlock::box(all, all, all));
}

// Four cells along x at a time. Most of them are marked already.
void EnvelopeBuilder::mark(const CellBlock& block, std::uint64_t cells) {
  const auto mark_in = [&](std::size_t word, std::uint64_t bits) {
    std::atomic_ref<std::uint64_t> marked(surface_.bits[word]);
    if ((marked.load(std::memory_order_relaxed) & bits) != bits) marked.fetch_or(bits, std::memory_order_relaxed);
  };
  while (cells != 0) {
    const auto row = static_cast<std::size_t>(std::countr_zero(cells)) / 4;
    const std::uint64_t four = cells >> (4 * row) & 15;
    cells &= ~(std::uint64_t{15} << (4 * row));
    const std::size_t cell = index_of(surface_, block.first[0], block.first[1] + row % 4, block.first[2] + row / 4),
                      at = cell % 64;
    mark_in(cell / 64, four << at);
    if (at > 60 && four >> (64 - at) != 0) mark_in(cell / 64 + 1, four >> (64 - at));
  }
}

EnvelopeGrid EnvelopeBuilder::finish() const {
  const std::int64_t ny = surface_.cells[1], nz = surface_.cells[2];
  const auto number = [&](std::int64_t y, std::int64_t z) { return static_cast<std::size_t>(y + ny * z); };
  const std::vector<Neighbor> within = neighbors(margin_cells_);
  const std::size_t farthest = std::ranges::max_element(within, {}, &Neighbor::x)->x;
  std::vector<Row> wide(number(0, nz), Row(words(surface_.cells[0])));
  for (std::int64_t z = 0; z < nz; ++z)
    for (std::int64_t y = 0; y < ny; ++y) {
      std::vector<Row> by_reach{row_at(surface_, surface_.cells[0] * number(y, z))};
      if (std::ranges::all_of(by_reach.front(), [](std::uint64_t word) { return word == 0; })) continue;
      while (by_reach.size() <= farthest) by_reach.push_back(widened(by_reach.back()));
      for (const Neighbor& row : within) {
        const std::int64_t j = y + row.y, k = z + row.z;
        if (j < 0 || k < 0 || j >= ny || k >= nz) continue;
        std::ranges::transform(wide[number(j, k)], by_reach[row.x], wide[number(j, k)].begin(), std::bit_or{});
      }
    }
  EnvelopeGrid grid = surface_;
  for (std::size_t row = 0; row < wide.size(); ++row) mark_row(grid, surface_.cells[0] * row, wide[row]);
  return grid;
}
}  // namespace lbea::bake
