// Compiled once per instruction set, each time into a namespace of its own (LBEA_KERNELS).
#include "runtime/src/kernels.hpp"
#include "runtime/src/lanes.hpp"

namespace lbea::LBEA_KERNELS {

namespace {

constexpr float infinity = __builtin_inff();
constexpr std::uint32_t outside = 0xffff'ffff;

struct Block {
  Floats x, y, z;
};

// Sixteen packed points, apart by coordinate; beyond `count` the last one again.
Block load_points(const float* points, std::size_t count) {
  float x[lanes], y[lanes], z[lanes];
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::size_t from = 3 * (i < count ? i : count - 1);
    x[i] = points[from];
    y[i] = points[from + 1];
    z[i] = points[from + 2];
  }
  return {load(x), load(y), load(z)};
}

Floats row(const float* T, const Block& p) { return T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3]; }

// The cell coordinate along one axis; `inside` loses the lanes beyond the grid, and NaN.
Ints cell_along(Floats position, const GridView& grid, std::size_t axis, Ints& inside) {
  const Floats cell = (position - grid.corner[axis]) * grid.cells_per_length;
  const float cells = static_cast<float>(grid.cells[axis]);
  inside &= (cell >= 0.0f) & (cell < cells);
  const Floats clamped = minimum(maximum(cell, Floats{}), all(cells - 1));  // what the conversion can represent
  return __builtin_convertvector(clamped, Ints);
}

std::uint32_t place(const float* points, std::size_t count, const float* T, const GridView& grid, float* const xyz[3],
                    std::uint32_t* rank) {
  std::uint32_t placed = 0;
  for (std::size_t begin = 0; begin < count; begin += lanes) {
    const std::size_t here = count - begin < lanes ? count - begin : lanes;
    const Block sensor = load_points(points + 3 * begin, here);
    const Floats position[3] = {row(T, sensor), row(T + 4, sensor), row(T + 8, sensor)};
    Ints inside = Ints{} - 1;
    const Ints x = cell_along(position[0], grid, 0, inside), y = cell_along(position[1], grid, 1, inside),
               z = cell_along(position[2], grid, 2, inside);
    const Ints cell = x + static_cast<std::int32_t>(grid.cells[0]) * (y + static_cast<std::int32_t>(grid.cells[1]) * z);
    for (std::size_t axis = 0; axis < 3; ++axis) store(xyz[axis] + begin, position[axis]);
    for (std::size_t i = 0; i < here; ++i) {
      rank[begin + i] = inside[i] ? grid.rank[cell[i]] : outside;
      placed += rank[begin + i] != outside;
    }
  }
  return placed;
}

// Over the first `count` lanes; a whole leaf, the usual case, by halves.
void enclose_lanes(const float* values, std::size_t count, float& low, float& high) {
  float least[lanes], most[lanes];
  for (std::size_t i = 0; i < lanes; ++i) {
    least[i] = i < count ? values[i] : infinity;
    most[i] = i < count ? values[i] : -infinity;
  }
  for (std::size_t width = lanes / 2; width > 0; width /= 2)
    for (std::size_t i = 0; i < width; ++i) {
      least[i] = least[i + width] < least[i] ? least[i + width] : least[i];
      most[i] = most[i + width] > most[i] ? most[i + width] : most[i];
    }
  low = least[0];
  high = most[0];
}

void fill_leaf(const PlacedPoint* points, std::size_t count, Leaf& leaf, float low[3], float high[3]) {
  for (std::size_t i = 0; i < count; ++i) {
    leaf.x[i] = points[i].x;
    leaf.y[i] = points[i].y;
    leaf.z[i] = points[i].z;
    leaf.point[i] = points[i].point;
  }
  for (std::size_t i = count; i < lanes; ++i) {
    leaf.x[i] = leaf.y[i] = leaf.z[i] = infinity;
    leaf.point[i] = NearestPoint::none;
  }
  enclose_lanes(leaf.x, count, low[0], high[0]);
  enclose_lanes(leaf.y, count, low[1], high[1]);
  enclose_lanes(leaf.z, count, low[2], high[2]);
}

void fill_leaves(const PlacedPoint* points, std::size_t count, Leaf* leaves, BoxGroup* boxes) {
  const std::size_t leaf_count = (count + lanes - 1) / lanes;
  for (std::size_t l = 0; l < (leaf_count + lanes - 1) / lanes * lanes; ++l) {
    BoxGroup& group = boxes[l / lanes];
    const std::size_t begin = l * lanes, here = begin < count ? (count - begin < lanes ? count - begin : lanes) : 0;
    float low[3] = {infinity, infinity, infinity}, high[3] = {-infinity, -infinity, -infinity};
    if (here > 0) fill_leaf(points + begin, here, leaves[l], low, high);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      group.low[axis][l % lanes] = low[axis];
      group.high[axis][l % lanes] = high[axis];
    }
  }
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
  for (std::uint32_t bits = at_most(squared, best.squared); bits != 0; bits &= bits - 1) {
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
  std::uint32_t open = at_most(distances, best.squared) & at_most(distances, 3e38f);
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
const Kernels table{LBEA_NAME(LBEA_KERNELS), place, fill_leaves, enclose, nearest, project, mode_distance};

}  // namespace lbea::LBEA_KERNELS
