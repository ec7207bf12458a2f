// Compiled once per instruction set, each time into a namespace of its own (LBEA_KERNELS).
#include "runtime/src/kernel_views.hpp"
#include "runtime/src/kernels.hpp"
#include "runtime/src/lanes.hpp"
#include "runtime/src/point_lanes.hpp"

namespace lbea::LBEA_KERNELS {

namespace {

constexpr float largest_finite = 3.4028234e38f;

// The last, incomplete group: its last point again and again.
Block load_last_points(const float* points, std::size_t count) {
  float packed[3 * lanes];
  for (std::size_t i = 0; i < lanes; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) packed[3 * i + axis] = points[3 * (i < count ? i : count - 1) + axis];
  return load_points(packed);
}

Floats row(const float* T, const Block& p) { return T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3]; }

// The cell coordinate along one axis, or twice that where cells are halved; `inside` loses the lanes beyond the grid,
// and NaN.
Ints fine_cell_along(Floats position, const GridView& grid, std::size_t axis, Ints& inside) {
  const Floats cell = (position - grid.corner[axis]) * grid.cells_per_length;
  const float cells = static_cast<float>(grid.cells[axis]), halves = static_cast<float>(1u << grid.halvings);
  inside &= (cell >= 0.0f) & (cell < cells);
  return to_ints(minimum(maximum(cell * halves, Floats{}), all(cells * halves - 1)));  // what an int can represent
}

void place(const float* points, std::size_t count, const float* T, const GridView& grid, PlacedPoint* placed, std::uint32_t* rank) {
  const auto halvings = static_cast<std::int32_t>(grid.halvings);
  constexpr std::int32_t counted[lanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const Ints first_numbers = loaded<Ints>(counted);
  const auto nx = static_cast<std::int32_t>(grid.cells[0]), ny = static_cast<std::int32_t>(grid.cells[1]);
  const std::int32_t no_cell = nx * ny * static_cast<std::int32_t>(grid.cells[2]);
  for (std::size_t begin = 0; begin < count; begin += lanes) {
    const Block sensor = count - begin >= lanes ? load_points(points + 3 * begin) : load_last_points(points + 3 * begin, count - begin);
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
    store_placed({position[0], position[1], position[2]}, first_numbers + static_cast<std::int32_t>(begin), placed + begin);
    for (std::size_t i = 0; i < lanes; ++i) rank[begin + i] = grid.rank[cell[i]] | octant[i];
  }
}

Corners fill_last_leaf(const PlacedPoint* points, std::size_t count, Leaf& leaf) {
  PlacedPoint repeated[lanes];
  for (std::size_t i = 0; i < lanes; ++i) repeated[i] = points[i < count ? i : count - 1];
  const Corners box = fill_whole_leaf(repeated, leaf);
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

void fill_leaves(const PlacedPoint* points, std::size_t count, Leaf* leaves, BoxGroup* boxes) {
  const std::size_t whole = count / lanes, rest = count % lanes;
  std::size_t leaf = 0;
  for (; leaf < whole; ++leaf) put(fill_whole_leaf(points + leaf * lanes, leaves[leaf]), boxes, leaf);
  if (rest > 0) put(fill_last_leaf(points + whole * lanes, rest, leaves[whole]), boxes, leaf++);
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

void search_leaf(const Leaf& leaf, const float query[3], NearestPoint& best) {
  const Floats dx = load(leaf.x) - query[0], dy = load(leaf.y) - query[1], dz = load(leaf.z) - query[2];
  const Floats squared = dx * dx + dy * dy + dz * dz;
  for (std::uint32_t bits = at_most(squared, all(best.squared)); bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(bits));
    if (squared[i] > best.squared || (squared[i] == best.squared && leaf.point[i] >= best.point)) continue;
    best = {leaf.point[i], squared[i], leaf.x[i], leaf.y[i], leaf.z[i]};
  }
}

Floats squared_distances(const BoxGroup& group, const float query[3]) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats outward = maximum(load(group.low[axis]) - query[axis], query[axis] - load(group.high[axis]));
    const Floats beyond = maximum(outward, Floats{});
    squared += beyond * beyond;
  }
  return squared;
}

// Nearest box first. A box at the bound may still hold an equally near point of lower place.
void search_group(const CloudTree& tree, std::size_t level, std::size_t group, const float query[3], NearestPoint& best) {
  float squared[lanes];
  const Floats distances = squared_distances(tree.groups[level][group], query);
  store(squared, distances);
  std::uint32_t open = at_most(distances, all(best.squared)) & at_most(distances, all(largest_finite));
  while (open != 0) {
    std::uint32_t next = static_cast<std::uint32_t>(__builtin_ctz(open));
    for (std::uint32_t rest = open & (open - 1); rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::uint32_t>(__builtin_ctz(rest));
      if (squared[i] < squared[next]) next = i;
    }
    if (squared[next] > best.squared) return;
    open &= ~(1u << next);
    const std::size_t child = group * lanes + next;
    if (level == 0)
      search_leaf(tree.leaves[child], query, best);
    else
      search_group(tree, level - 1, child, query, best);
  }
}

NearestPoint nearest(const CloudTree& tree, const float query[3], NearestPoint bound) {
  search_group(tree, tree.top, 0, query, bound);
  return bound;
}

// Sixteen queries on their way through the tree.
struct Queries {
  const float* const* planes;
  Floats x, y, z;
  Corners box;
  Floats squared;  // as in `best`, kept at hand
  NearestPoints& best;
  bool any = false;  // the first point within the bound is as good as the nearest

  // Below 0: nothing can be nearer, this query is through.
  void look() {
    squared = load(best.squared);
    if (!any) return;
    squared = choose(loaded<Ints>(best.point) != static_cast<std::int32_t>(NearestPoint::none), all(-1.0f), squared);
  }
};

void offer(NearestPoints& best, std::size_t query, float squared, std::uint32_t point, std::uint32_t slot) {
  if (squared > best.squared[query] || (squared == best.squared[query] && point >= best.point[query])) return;
  best.squared[query] = squared;
  best.point[query] = point;
  best.slot[query] = slot;
}

// Sixteen points for one query; whether one of them is as near as what is known.
bool take_in_for(std::size_t query, const Leaf& leaf, std::size_t number, Queries& q) {
  const Floats dx = load(leaf.x) - q.planes[0][query], dy = load(leaf.y) - q.planes[1][query], dz = load(leaf.z) - q.planes[2][query];
  const Floats squared = dx * dx + dy * dy + dz * dz;
  std::uint32_t near = at_most(squared, all(q.best.squared[query]));
  if (near == 0) return false;
  if ((near & (near - 1)) != 0) near = at_most(squared, all(-greatest(-squared)));
  for (; near != 0; near &= near - 1) {
    const auto i = static_cast<std::uint32_t>(__builtin_ctz(near));
    offer(q.best, query, squared[i], leaf.point[i], static_cast<std::uint32_t>(number * lanes) + i);
  }
  return true;
}

// Sixteen points for those queries that hope to find something.
void take_in_leaf(const Leaf& leaf, std::size_t number, std::uint32_t hoping, Queries& q) {
  bool found = false;
  for (; hoping != 0; hoping &= hoping - 1) found |= take_in_for(static_cast<std::size_t>(__builtin_ctz(hoping)), leaf, number, q);
  if (found) q.look();
}

// Bit by query: whether it may find something in this box. The sixteen distances bound better than that of their common box.
std::uint32_t hoping_for(const BoxGroup& group, std::size_t i, const Queries& q) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats& position = axis == 0 ? q.x : axis == 1 ? q.y : q.z;
    const Floats outward = maximum(maximum(group.low[axis][i] - position, position - group.high[axis][i]), Floats{});
    squared += outward * outward;
  }
  return at_most(squared, q.squared);
}

Floats squared_gaps(const BoxGroup& group, const Corners& box) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats gap = maximum(maximum(load(group.low[axis]) - box.high[axis], box.low[axis] - load(group.high[axis])), Floats{});
    squared += gap * gap;
  }
  return squared;
}

void search_group_16(const CloudTree& tree, std::size_t level, std::size_t group, Queries& q) {
  const BoxGroup& boxes = tree.groups[level][group];
  const Floats gaps = squared_gaps(boxes, q.box);
  std::uint32_t open = at_most(gaps, all(greatest(q.squared))) & at_most(gaps, all(largest_finite));
  std::uint32_t now = at_most(gaps, all(-greatest(-gaps))) & open;  // the nearest first, then the rest as they come
  for (open &= ~now; (now | open) != 0; now = open, open = 0)
    for (; now != 0; now &= now - 1) {
      const auto i = static_cast<std::size_t>(__builtin_ctz(now));
      const std::uint32_t hoping = hoping_for(boxes, i, q);
      if (hoping == 0) continue;
      const std::size_t child = group * lanes + i;
      if (level == 0)
        take_in_leaf(tree.leaves[child], child, hoping, q);
      else
        search_group_16(tree, level - 1, child, q);
    }
}

void search_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best, bool any) {
  Queries q{queries, load(queries[0]), load(queries[1]), load(queries[2]), {}, {}, best, any};
  const Floats* const coordinates[3] = {&q.x, &q.y, &q.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    q.box.low[axis] = -greatest(-*coordinates[axis]);
    q.box.high[axis] = greatest(*coordinates[axis]);
  }
  for (std::size_t i = 0; i < lanes; ++i)
    if (hints[i] != NearestPoint::none) take_in_for(i, tree.leaves[hints[i] / lanes], hints[i] / lanes, q);
  q.look();
  search_group_16(tree, tree.top, 0, q);
}

void nearest_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) {
  search_16(tree, queries, hints, best, false);
}

void any_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) {
  search_16(tree, queries, hints, best, true);
}

void project(const float* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients) {
  for (std::size_t j = 0; j < rows; ++j) {
    const float* weights = projection + j * stride;
    Floats even{}, odd{};  // two sums: the next product does not wait for the last one
    std::size_t i = 0;
    for (; i + 2 * lanes <= stride; i += 2 * lanes) {
      even += load(weights + i) * load(f + i);
      odd += load(weights + i + lanes) * load(f + i + lanes);
    }
    if (i < stride) even += load(weights + i) * load(f + i);
    coefficients[j] = sum(even + odd);
  }
}

float mode_distance(const float* const e[3], const float* sample, std::size_t stride, float bound) {
  constexpr std::size_t modes_between_looks = 2 * lanes;
  Floats distances{};
  for (std::size_t j = 0; j < stride; j += lanes) {
    const Floats dx = load(e[0] + j) - load(sample + j), dy = load(e[1] + j) - load(sample + stride + j),
                 dz = load(e[2] + j) - load(sample + 2 * stride + j);
    distances += square_roots(dx * dx + dy * dy + dz * dz);
    if ((j + lanes) % modes_between_looks == 0 && !(sum(distances) < bound)) break;  // it only grows
  }
  return sum(distances);
}

}  // namespace

extern const Kernels table;
#define LBEA_STRING(name) #name
#define LBEA_NAME(name) LBEA_STRING(name)
const Kernels table{LBEA_NAME(LBEA_KERNELS), place, fill_leaves, enclose, nearest, nearest_16, any_16, project, mode_distance,
                    add_depths,             compare_views, subtract_views};

}  // namespace lbea::LBEA_KERNELS
