// Compiled once per instruction set, each time into a separate namespace (LBEA_KERNELS).
#include "runtime/src/kernels/denormals.hpp"
#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/kernels/lanes.hpp"

namespace lbea::LBEA_KERNELS {
namespace {
// Conversion of sixteen points between layouts: packed x y z, planes of one coordinate, x y z and number per point,
// leaves.
constexpr float infinity = __builtin_inff();

struct Block {
  Floats x, y, z;
};

struct Corners {
  float low[3], high[3];
};
constexpr Corners inverted{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};

#if defined(__AVX512F__)

// Separates three vectors of packed x y z by coordinate. Lanes 0-15 are the first vector, 16-31 the second.
Block apart(const Floats& a, const Floats& b, const Floats& c) {
  const Floats x = pick<0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0>(a, b);
  const Floats y = pick<1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0>(a, b);
  const Floats z = pick<2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0>(a, b);
  return {pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29>(x, c),
          pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30>(y, c),
          pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31>(z, c)};
}

Block load_points(const float* points) { return apart(load(points), load(points + lanes), load(points + 2 * lanes)); }

// Stores x y z and number of sixteen points, point by point.
void store_placed(const Block& position, const Ints& number, PlacedPoint* to) {
  const auto& [x, y, z] = position;
  Floats p;
  __builtin_memcpy(&p, &number, sizeof(p));
  const auto lower_pairs = [](const Floats& a, const Floats& b) {
    return pick<0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23>(a, b);
  };
  const auto upper_pairs = [](const Floats& a, const Floats& b) {
    return pick<8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31>(a, b);
  };
  const auto lower_fours = [](const Floats& a, const Floats& b) {
    return pick<0, 1, 16, 17, 2, 3, 18, 19, 4, 5, 20, 21, 6, 7, 22, 23>(a, b);
  };
  const auto upper_fours = [](const Floats& a, const Floats& b) {
    return pick<8, 9, 24, 25, 10, 11, 26, 27, 12, 13, 28, 29, 14, 15, 30, 31>(a, b);
  };
  const Floats xy[2] = {lower_pairs(x, y), upper_pairs(x, y)}, zp[2] = {lower_pairs(z, p), upper_pairs(z, p)};
  for (std::size_t half = 0; half < 2; ++half) {
    store(&to[8 * half].x, lower_fours(xy[half], zp[half]));
    store(&to[8 * half + 4].x, upper_fours(xy[half], zp[half]));
  }
}

Floats halves_swapped(const Floats& v) { return pick<8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7>(v, v); }
Floats quarters_swapped(const Floats& v) { return pick<4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11>(v, v); }

// The box of vectors of four points, x y z and number each: lanes 0, 1, 2 after folding.
Corners corners(Floats low, Floats high) {
  low = minimum(low, halves_swapped(low));
  low = minimum(low, quarters_swapped(low));
  high = maximum(high, halves_swapped(high));
  high = maximum(high, quarters_swapped(high));
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

// Of eight points x y z p: eight x and eight y, or eight z and eight p.
Floats pick_xy(const Floats& a, const Floats& b) {
  return pick<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(a, b);
}
Floats pick_zp(const Floats& a, const Floats& b) {
  return pick<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(a, b);
}
Floats first_halves(const Floats& a, const Floats& b) {
  return pick<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(a, b);
}
Floats second_halves(const Floats& a, const Floats& b) {
  return pick<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(a, b);
}

// Converts the bytes of sixteen placed points to a leaf and returns its box.
Corners fill_whole_leaf(Leaf& leaf) {
  const float* from = leaf.x;
  const Floats a = load(from), b = load(from + lanes), c = load(from + 2 * lanes), d = load(from + 3 * lanes);
  // Pairs of coordinates of the first and the last eight points, then one coordinate of all sixteen.
  const Floats xy_low = pick_xy(a, b), xy_high = pick_xy(c, d), zp_low = pick_zp(a, b), zp_high = pick_zp(c, d);
  store(leaf.x, first_halves(xy_low, xy_high));
  store(leaf.y, second_halves(xy_low, xy_high));
  store(leaf.z, first_halves(zp_low, zp_high));
  store(leaf.point, second_halves(zp_low, zp_high));
  return corners(minimum(minimum(a, b), minimum(c, d)), maximum(maximum(a, b), maximum(c, d)));
}

#else

// x y z x | y z x y | z x y z: four points.
Fours apart(Four a, Four b, Four c) {
  const Four x = __builtin_shufflevector(a, b, 0, 3, 6, 6), y = __builtin_shufflevector(a, b, 1, 4, 7, 7),
             z = __builtin_shufflevector(a, b, 2, 5, 5, 5);
  return {{__builtin_shufflevector(x, c, 0, 1, 2, 5), __builtin_shufflevector(y, c, 0, 1, 2, 6),
           __builtin_shufflevector(z, c, 0, 1, 4, 7), Four{}}};
}

Block load_points(const float* points) {
  Fours x, y, z;
  for (std::size_t i = 0; i < 4; ++i) {
    const float* from = points + 12 * i;
    const Fours xyz = apart(load_four(from), load_four(from + 4), load_four(from + 8));
    x.at[i] = xyz.at[0], y.at[i] = xyz.at[1], z.at[i] = xyz.at[2];
  }
  return {joined(x), joined(y), joined(z)};
}

// Stores x y z and number of sixteen points, point by point.
void store_placed(const Block& position, const Ints& number, PlacedPoint* to) {
  Floats p;
  __builtin_memcpy(&p, &number, sizeof(p));
  const Fours x = divided(position.x), y = divided(position.y), z = divided(position.z), numbers = divided(p);
  for (std::size_t i = 0; i < 4; ++i) {
    const Fours points = transposed({{x.at[i], y.at[i], z.at[i], numbers.at[i]}});
    for (std::size_t k = 0; k < 4; ++k) store_four(&to[4 * i + k].x, points.at[k]);
  }
}

// Converts the bytes of sixteen placed points to a leaf and returns its box: lanes 0, 1, 2 after folding.
Corners fill_whole_leaf(Leaf& leaf) {
  const float* from = leaf.x;
  Fours coordinates[4];
  Four low = load_four(from), high = low;
  for (std::size_t i = 0; i < 4; ++i) {
    Fours of_points;
    for (std::size_t k = 0; k < 4; ++k) {
      const Four point = of_points.at[k] = load_four(from + 16 * i + 4 * k);
      low = point < low ? point : low;
      high = point > high ? point : high;
    }
    coordinates[i] = transposed(of_points);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    store_four(leaf.x + 4 * i, coordinates[i].at[0]);
    store_four(leaf.y + 4 * i, coordinates[i].at[1]);
    store_four(leaf.z + 4 * i, coordinates[i].at[2]);
    __builtin_memcpy(leaf.point + 4 * i, &coordinates[i].at[3], sizeof(Four));
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

#endif

// The last, incomplete group, filled up with its last point.
Block load_last_points(const float* points, std::size_t count) {
  float packed[3 * lanes];
  for (std::size_t i = 0; i < lanes; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) packed[3 * i + axis] = points[3 * (i < count ? i : count - 1) + axis];
  return load_points(packed);
}

Floats row(const float* T, const Block& p) { return T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3]; }

// The cell coordinate along one axis, doubled where cells are halved. Clears the lanes of `inside` that are beyond the
// grid or NaN.
Ints fine_cell_along(Floats position, const GridView& grid, std::size_t axis, Ints& inside) {
  const Floats cell = (position - grid.corner[axis]) * grid.cells_per_length;
  const float cells = static_cast<float>(grid.cells[axis]), halves = static_cast<float>(1u << grid.halvings);
  inside &= (cell >= 0.0f) & (cell < cells);
  return to_ints(
      minimum(maximum(cell * halves, Floats{}), all(cells * halves - 1)));  // clamped to what an int can represent
}

__attribute__((noinline)) void place_all(const float* points, std::size_t count, const float* T, const GridView& grid,
                                         PlacedPoint* placed, std::uint32_t* rank) {
  const auto halvings = static_cast<std::int32_t>(grid.halvings);
  constexpr std::int32_t counted[lanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const Ints first_numbers = loaded<Ints>(counted);
  const auto nx = static_cast<std::int32_t>(grid.cells[0]), ny = static_cast<std::int32_t>(grid.cells[1]);
  const std::int32_t no_cell = nx * ny * static_cast<std::int32_t>(grid.cells[2]);
  for (std::size_t begin = 0; begin < count; begin += lanes) {
    const Block sensor =
        count - begin >= lanes ? load_points(points + 3 * begin) : load_last_points(points + 3 * begin, count - begin);
    const Floats position[3] = {row(T, sensor), row(T + 4, sensor), row(T + 8, sensor)};
    Ints inside = all_of(std::int32_t{-1});
    const Ints x = fine_cell_along(position[0], grid, 0, inside), y = fine_cell_along(position[1], grid, 1, inside),
               z = fine_cell_along(position[2], grid, 2, inside);
    const Ints cells = choose(inside, (x >> halvings) + nx * ((y >> halvings) + ny * (z >> halvings)), all_of(no_cell));
    const Ints octants = (x & halvings) | (y & halvings) << 1 | (z & halvings) << 2;
    std::int32_t cell[lanes];
    std::uint32_t octant[lanes];
    store(cell, cells);
    store(octant, octants);
    store_placed({position[0], position[1], position[2]}, first_numbers + static_cast<std::int32_t>(begin),
                 placed + begin);
    for (std::size_t i = 0; i < lanes; ++i) rank[begin + i] = grid.rank[cell[i]] | octant[i];
  }
}

void place(const float* points, std::size_t count, const float* T, const GridView& grid, PlacedPoint* placed,
           std::uint32_t* rank) {
  [[maybe_unused]] const DenormalsAreZero mode;
  place_all(points, count, T, grid, placed, rank);
}

std::size_t find_runs(const std::uint32_t* rank, std::size_t count, std::uint32_t* begins) {
  std::size_t runs = 0;
  if (count > 0) begins[runs++] = 0;
  for (std::size_t i = 1; i < count; i += lanes) {
    const std::uint32_t here = count - i < lanes ? (1u << (count - i)) - 1 : 0xffff;
    const std::uint32_t changed = differing(loaded<Ints>(rank + i), loaded<Ints>(rank + i - 1));
    runs += append_lanes(begins + runs, static_cast<std::uint32_t>(i), changed & here);
  }
  begins[runs] = static_cast<std::uint32_t>(count);
  return runs;
}

// The last, incomplete leaf, filled up with its last point to compute the box.
Corners fill_last_leaf(std::size_t count, Leaf& leaf) {
  PlacedPoint points[lanes];
  __builtin_memcpy(points, &leaf, sizeof(points));
  for (std::size_t i = count; i < lanes; ++i) points[i] = points[count - 1];
  __builtin_memcpy(&leaf, points, sizeof(points));
  const Corners box = fill_whole_leaf(leaf);
  for (std::size_t i = count; i < lanes; ++i) {
    leaf.x[i] = leaf.y[i] = leaf.z[i] = infinity;
    leaf.point[i] = NearestPoint::none;
  }
  return box;
}

void put(const Corners& box, BoxGroup* boxes, std::size_t place) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    boxes[place / lanes].low[axis][place % lanes] = box.low[axis];
    boxes[place / lanes].high[axis][place % lanes] = box.high[axis];
  }
}

void fill_leaves(std::size_t count, Leaf* leaves, BoxGroup* boxes) {
  const std::size_t whole = count / lanes, rest = count % lanes;
  std::size_t leaf = 0;
  for (; leaf < whole; ++leaf) put(fill_whole_leaf(leaves[leaf]), boxes, leaf);
  if (rest > 0) put(fill_last_leaf(rest, leaves[whole]), boxes, leaf++);
  for (; leaf % lanes != 0; ++leaf) put(inverted, boxes, leaf);
}

void enclose(const BoxGroup* children, std::size_t count, BoxGroup* parents) {
  const std::size_t groups = (count + lanes - 1) / lanes;
  for (std::size_t g = 0; g < (groups + lanes - 1) / lanes * lanes; ++g)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float low = infinity, high = -infinity;
      for (std::size_t i = 0; i < lanes && g < groups; ++i) {  // inverted boxes change nothing
        low = children[g].low[axis][i] < low ? children[g].low[axis][i] : low;
        high = children[g].high[axis][i] > high ? children[g].high[axis][i] : high;
      }
      parents[g / lanes].low[axis][g % lanes] = low;
      parents[g / lanes].high[axis][g % lanes] = high;
    }
}

// Depth images, cell by cell.
constexpr float largest_cell = 1e6f;

Floats load_depths(const std::uint16_t* from) { return to_floats(load_shorts(from)); }

// The cell's number, truncated; a coordinate that is not finite becomes a number outside.
Ints cell_number(const Floats& cell) { return to_ints(minimum(maximum(cell, all(-1.0f)), all(largest_cell))); }

struct Cells {
  Floats squares;  // of the capped difference, or of the cost of a cell that only one image fills
  Floats filled;   // 1 where at least one image fills the cell
};

Cells compare(Floats observed, Floats sample, const CellPrices& prices) {
  const Ints in_frame = observed >= 0.0f, in_sample = (sample > 0.0f) & (observed > not_observed);
  const Floats difference = observed - sample;
  const Floats capped = maximum(minimum(difference, all(prices.cap)), all(-prices.cap));
  const Floats one_sided = choose(in_frame ^ in_sample, all(prices.one_sided), Floats{});
  const Floats cost = choose(in_frame & in_sample, capped, one_sided);
  return {cost * cost, choose(in_frame | in_sample, all(1.0f), Floats{})};
}

void add_multiple(float weight, const float* values, std::size_t count, float* sum) {
  for (std::size_t i = 0; i < count; i += lanes) store(sum + i, load(sum + i) + weight * load(values + i));
}

// Inlined, it would be repeated for each of the ten sums.
__attribute__((noinline)) float one_sum(const Floats& values) { return sum(values); }

// One register's width at a time, so that the ten sums stay in registers.
void sum_moments(const Leaf* const* leaves, std::size_t count, const float place[3], float reach, float sums[10]) {
  using Part = Floats::Part;
  const float per_square = 1 / (reach * reach);
  Floats lane_sums[10];
  for (std::size_t i = 0; i < Floats::parts; ++i) {
    Part part[10]{};
    for (std::size_t leaf = 0; leaf < count; ++leaf) {
      Part x = load_part(leaves[leaf]->x, i) - place[0], y = load_part(leaves[leaf]->y, i) - place[1],
           z = load_part(leaves[leaf]->z, i) - place[2], w = 1.0f - per_square * (x * x + y * y + z * z);
      const auto is_near = w > 0.0f;
      x = is_near ? x : Part{}, y = is_near ? y : Part{}, z = is_near ? z : Part{}, w = is_near ? w : Part{};
      const Part wx = w * x, wy = w * y, wz = w * z;
      part[0] += w, part[1] += wx, part[2] += wy, part[3] += wz;
      part[4] += wx * x, part[5] += wx * y, part[6] += wx * z, part[7] += wy * y, part[8] += wy * z, part[9] += wz * z;
    }
    for (std::size_t moment = 0; moment < 10; ++moment) lane_sums[moment].part[i] = part[moment];
  }
  for (std::size_t moment = 0; moment < 10; ++moment) sums[moment] = one_sum(lane_sums[moment]);
}

using Pair = float __attribute__((vector_size(8)));  // a depth and 1: one addition for both sums

void add_depths(const Leaf* leaves, std::size_t count, const float T[12], const CellRaster& raster,
                CellTally* tallies) {
  const auto columns = static_cast<std::int32_t>(raster.columns), rows = static_cast<std::int32_t>(raster.rows);
  for (std::size_t leaf = 0; leaf < count; ++leaf) {
    const Block point{load(leaves[leaf].x), load(leaves[leaf].y), load(leaves[leaf].z)};
    const Floats depth = row(T + 8, point);
    const Floats scale = raster.focal / depth;
    const Floats u = row(T, point) * scale + raster.center_column, v = row(T + 4, point) * scale + raster.center_row;
    const Ints column = cell_number(u), line = cell_number(v);
    const Ints inside = (u >= 0.0f) & (v >= 0.0f) & (column < columns) & (line < rows) & (depth > 0.0f);
    const Ints cells = choose(inside, line * columns + column, all_of(columns * rows));
    std::int32_t cell[lanes];
    float value[lanes];
    store(cell, cells);
    store(value, (depth - raster.depth_origin) * raster.steps_per_depth);
    for (std::size_t i = 0; i < lanes; ++i) {
      Pair sum, one{value[i], 1.0f};
      __builtin_memcpy(&sum, &tallies[cell[i]].of[i % 4], sizeof(sum));
      sum += one;
      __builtin_memcpy(&tallies[cell[i]].of[i % 4], &sum, sizeof(sum));
    }
  }
}

CellSums compare_depths(const float* observed, const std::uint16_t* sample, std::size_t cells,
                        const CellPrices& prices) {
  Floats squares{}, filled{};
  for (std::size_t i = 0; i < cells; i += lanes) {
    const Cells compared = compare(load(observed + i), load_depths(sample + i), prices);
    squares += compared.squares;
    filled += compared.filled;
  }
  return {sum(squares), sum(filled)};
}

// Sums over lines, of integers: exact in any order.
struct LineTally {
  Ints squares{};
  Shorts filled{}, counted{};
};

void compare_line(const std::uint16_t* observed, const std::uint16_t* counted, const std::uint16_t* sample,
                  const ShortPrices& prices, LineTally& tally) {
  for (std::size_t i = 0; i < Shorts::parts; ++i) {
    const Shorts::Part seen = load_part(observed, i), expected = load_part(sample, i);
    const Shorts::Part in_frame = is_filled(seen), in_sample = is_filled(expected), in_one = in_frame ^ in_sample;
    const Shorts::Part a = seen >> prices.shift, b = expected >> prices.shift;
    const Shorts::Part difference = reduced(a, b) | reduced(b, a);
    const Shorts::Part capped = difference - reduced(difference, Shorts::Part{} + prices.cap);
    const Shorts::Part cost = (capped & ~in_one) | ((Shorts::Part{} + prices.one_sided) & in_one);
    tally.squares.part[i] += pair_sums(cost, cost);
    tally.filled.part[i] -= in_frame | in_sample;  // true is -1
    tally.counted.part[i] -= in_sample & load_part(counted, i);
  }
}

LineSums compare_lines(const ImageLines& frame, const std::uint16_t* sample, const ShortPrices& prices, float most,
                       const std::uint16_t* next) {
  Floats squares{}, filled{}, counted{};
  for (std::size_t begin = 0; begin < frame.count; begin += ImageLines::part) {
    const std::size_t end = begin + ImageLines::part < frame.count ? begin + ImageLines::part : frame.count;
    LineTally tally;
    for (std::size_t line = begin; line < end; ++line) {
      __builtin_prefetch(next + frame.begins[line]);
      const std::size_t cell = line * ImageLines::cells;
      compare_line(frame.observed + cell, frame.counted + cell, sample + frame.begins[line], prices, tally);
    }
    squares += to_floats(tally.squares);
    filled += to_floats(pair_sums(tally.filled));
    counted += to_floats(pair_sums(tally.counted));
    const float cells = sum(filled) + frame.filled_after[begin / ImageLines::part];
    if (sum(squares) > most * cells) return {{infinity, cells}, 0};
  }
  return {{sum(squares), sum(filled)}, sum(counted)};
}

void subtract_depths(const float* observed, const std::uint16_t* sample, std::size_t cells, const CellPrices& prices,
                     float* residual) {
  for (std::size_t i = 0; i < cells; i += lanes) {
    const Floats seen = load(observed + i), expected = load_depths(sample + i);
    const Ints in_frame = seen >= 0.0f, in_sample = (expected > 0.0f) & (seen > not_observed);
    const Floats capped = maximum(minimum(expected - seen, all(prices.cap)), all(-prices.cap));
    const Floats one_sided = choose(in_frame, all(-prices.one_sided), all(prices.one_sided));
    const Floats either = choose(in_frame ^ in_sample, one_sided, Floats{});
    store(residual + i, choose(in_frame & in_sample, capped, either));
  }
}
}  // namespace

extern const Kernels table;
#define LBEA_STRING(name) #name
#define LBEA_NAME(name) LBEA_STRING(name)
const Kernels table{LBEA_NAME(LBEA_KERNELS),
                    place,
                    find_runs,
                    fill_leaves,
                    enclose,
                    nearest,
                    nearest_16,
                    project,
                    project_short,
                    mode_distance,
                    add_multiple,
                    sum_moments,
                    add_depths,
                    compare_depths,
                    compare_lines,
                    subtract_depths};
}  // namespace lbea::LBEA_KERNELS
