// The searches: nearest points of a cloud to one query and to sixteen at once; coefficients and their distances.
// Compiled once per instruction set, like kernel_code.cpp.
#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/kernels/lanes.hpp"

namespace lbea::LBEA_KERNELS {
namespace {
constexpr float infinity = __builtin_inff(), largest_finite = 3.4028234e38f;

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

// Nearest box first. A box exactly at the bound may hold an equally near point that comes first in the frame.
void search_group(const CloudTree& tree, std::size_t level, std::size_t group, const float query[3],
                  NearestPoint& best) {
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

// The search of sixteen queries. Which leaves a query must test is hard to predict, so (leaf, query) pairs are listed
// first and then tested in one loop without branches.
struct Search {
  static constexpr std::size_t enough = 24;      // listed pairs after which testing them pays off: it lowers the bounds
  static constexpr std::uint32_t many_ties = 8;  // the cloud is not an ordinary one

  const CloudTree& tree;
  const float* const* planes;
  Floats x, y, z;
  float low[3], high[3];      // their common box
  std::uint64_t best[lanes];  // bits of the squared distance, then the leaf: a nearer candidate is a smaller number
  bool is_first = true;       // no leaf but those of the hints has been tested
  std::uint32_t ties = 0;     // resolved so far
  std::uint64_t placed[lanes] = {};  // the value of `best` for which `place` holds the place in the frame
  std::uint32_t place[lanes];
  std::size_t count = 0;
  std::uint32_t listed[enough + lanes * lanes + lanes];  // leaf * 16 + query

  Search(const CloudTree& cloud, const float* const queries[3])
      : tree(cloud), planes(queries), x(load(queries[0])), y(load(queries[1])), z(load(queries[2])) {
    const Floats* const coordinates[3] = {&x, &y, &z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = least(*coordinates[axis]);
      high[axis] = greatest(*coordinates[axis]);
    }
  }
};

// Squared distances are not negative, so their bits have the order of the values.
std::uint64_t candidate(float squared, std::uint32_t leaf) {
  std::uint32_t bits;
  __builtin_memcpy(&bits, &squared, sizeof(bits));
  return std::uint64_t{bits} << 32 | leaf;
}
std::uint32_t leaf_of(std::uint64_t candidate) { return static_cast<std::uint32_t>(candidate); }
float squared_of(std::uint64_t candidate) {
  const auto bits = static_cast<std::uint32_t>(candidate >> 32);
  float squared;
  __builtin_memcpy(&squared, &bits, sizeof(squared));
  return squared;
}

Floats bounds_of(const Search& search) {
  float bounds[lanes];
  for (std::size_t i = 0; i < lanes; ++i) bounds[i] = squared_of(search.best[i]);
  return load(bounds);
}

Floats squared_distances(const Leaf& leaf, const float* const planes[3], std::size_t query) {
  const Floats dx = load(leaf.x) - planes[0][query], dy = load(leaf.y) - planes[1][query],
               dz = load(leaf.z) - planes[2][query];
  return dx * dx + dy * dy + dz * dz;
}

// Among the leaf's points at this distance, the lane of the one that comes first in the frame.
std::size_t lane_at(const Leaf& leaf, const float* const planes[3], std::size_t query, float squared) {
  std::uint32_t at = at_most(squared_distances(leaf, planes, query), all(squared));
  auto lowest = static_cast<std::size_t>(__builtin_ctz(at));
  for (at &= at - 1; at != 0; at &= at - 1) {
    const auto lane = static_cast<std::size_t>(__builtin_ctz(at));
    if (leaf.point[lane] < leaf.point[lowest]) lowest = lane;
  }
  return lowest;
}

std::uint32_t place_in(const Search& search, std::uint32_t leaf, std::size_t query, float squared) {
  const Leaf& points = search.tree.leaves[leaf];
  return points.point[lane_at(points, search.planes, query, squared)];
}

std::uint32_t place_of_best(Search& search, std::size_t query) {
  const std::uint64_t best = search.best[query];
  if (leaf_of(best) == NearestPoint::none) return NearestPoint::none;
  if (search.placed[query] != best) {
    search.placed[query] = best;
    search.place[query] = place_in(search, leaf_of(best), query, squared_of(best));
  }
  return search.place[query];
}

// Two leaves have a point at the same distance, or one has a point exactly at the bound.
__attribute__((noinline)) void resolve_tie(Search& search, std::uint32_t rival, std::size_t query) {
  ++search.ties;
  const std::uint32_t place = place_of_best(search, query);
  if (search.tree.is_crowded && search.tree.first[0][rival] >= place) return;
  const float squared = squared_of(search.best[query]);
  if (place_in(search, rival, query, squared) < place) search.best[query] = candidate(squared, rival);
}

__attribute__((always_inline)) inline void test_leaf(Search& search, std::uint32_t leaf, std::size_t query) {
  const std::uint64_t found = candidate(least(squared_distances(search.tree.leaves[leaf], search.planes, query)), leaf);
  const std::uint64_t best = search.best[query];
  if (((found ^ best) >> 32 == 0) & (found != best)) return resolve_tie(search, leaf, query);
  search.best[query] = found < best ? found : best;
}

void test_listed(Search& search) {
  for (std::size_t i = 0; i < search.count; ++i)
    test_leaf(search, static_cast<std::uint32_t>(search.listed[i] / lanes), search.listed[i] % lanes);
  search.count = 0;
}

// Squared distances of the queries from a box.
Floats squared_distances(const BoxGroup& group, std::size_t i, const Search& search) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats& position = axis == 0 ? search.x : axis == 1 ? search.y : search.z;
    const Floats outward = maximum(maximum(group.low[axis][i] - position, position - group.high[axis][i]), Floats{});
    squared += outward * outward;
  }
  return squared;
}

// Bit i: the box may hold a nearer point for query i.
std::uint32_t queries_for(const BoxGroup& group, std::size_t i, const Search& search, const Floats& bounds) {
  return at_most(squared_distances(group, i, search), bounds);
}

void list(Search& search, std::size_t group, std::uint32_t open) {
  const Floats bounds = bounds_of(search);
  for (; open != 0; open &= open - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(open));
    const auto first = static_cast<std::uint32_t>((group * lanes + i) * lanes);
    search.count +=
        append_lanes(search.listed + search.count, first, queries_for(search.tree.groups[0][group], i, search, bounds));
  }
}

// Squared distances of the boxes from the queries' common box.
Floats squared_gaps(const BoxGroup& group, const Search& search) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats gap = maximum(
        maximum(load(group.low[axis]) - search.high[axis], search.low[axis] - load(group.high[axis])), Floats{});
    squared += gap * gap;
  }
  return squared;
}

// The search of a crowded cloud, query by query: boxes nearest first, among equally near ones that with the first point
// of the frame. Few boxes that are as near as the best point are tested after it, however many there are.

std::size_t next_box(const Floats& squared, const std::uint32_t* first, std::uint32_t open) {
  const float lowest = least(choose(lanes_of(open), squared, all(infinity)));
  std::uint32_t ties = open & at_most(squared, all(lowest));
  auto next = static_cast<std::size_t>(__builtin_ctz(ties));
  for (ties &= ties - 1; ties != 0; ties &= ties - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(ties));
    if (first[i] < first[next]) next = i;
  }
  return next;
}

// The order matters only among the leaves that are as near as the best point.
void search_crowded_leaves(Search& search, std::size_t group, std::size_t query, const Floats& distances,
                           std::uint32_t open) {
  const auto leaf = static_cast<std::uint32_t>(group * lanes);
  const std::uint32_t* const first = search.tree.first[0] + group * lanes;
  const auto bound = [&] { return all(squared_of(search.best[query])); };
  for (std::uint32_t nearer = open & ~at_most(bound(), distances); nearer != 0; nearer &= nearer - 1)
    test_leaf(search, leaf + static_cast<std::uint32_t>(__builtin_ctz(nearer)), query);
  for (open &= at_most(distances, bound()) & at_most(bound(), distances); open != 0;) {
    const std::size_t i = next_box(distances, first, open);
    if (first[i] >= place_of_best(search, query)) return;
    open &= ~(1u << i);
    test_leaf(search, leaf + static_cast<std::uint32_t>(i), query);
  }
}

void search_crowded_group(Search& search, std::size_t level, std::size_t group, std::size_t query) {
  const float position[3] = {search.planes[0][query], search.planes[1][query], search.planes[2][query]};
  const std::uint32_t* const first = search.tree.first[level] + group * lanes;
  const Floats distances = squared_distances(search.tree.groups[level][group], position);
  std::uint32_t open =
      at_most(distances, all(squared_of(search.best[query]))) & at_most(distances, all(largest_finite));
  if (level == 0) {
    if (open != 0) search_crowded_leaves(search, group, query, distances, open);
    return;
  }
  while (open != 0) {
    const std::size_t i = next_box(distances, first, open);
    const float bound = squared_of(search.best[query]), squared = distances[i];
    if (squared > bound || (squared == bound && first[i] >= place_of_best(search, query))) return;
    open &= ~(1u << i);
    search_crowded_group(search, level - 1, group * lanes + i, query);
  }
}

void search_crowded(Search& search) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::uint32_t known = i > 0 ? leaf_of(search.best[i - 1]) : NearestPoint::none;
    if (known != NearestPoint::none) test_leaf(search, known, i);
    search_crowded_group(search, search.tree.top, 0, i);
  }
}

bool is_flooded(const Search& search) { return search.ties >= Search::many_ties && search.tree.is_crowded; }

// The nearest box first, then the others in their order.
void search_group_16(Search& search, std::size_t level, std::size_t group) {
  const BoxGroup& boxes = search.tree.groups[level][group];
  const Floats gaps = squared_gaps(boxes, search);
  std::uint32_t open = at_most(gaps, all(greatest(bounds_of(search)))) & at_most(gaps, all(largest_finite));
  std::uint32_t now = at_most(gaps, all(least(gaps))) & open;
  if (level == 0) {
    if (search.is_first) {
      list(search, group, now);
      test_listed(search);
      open &= ~now;
      search.is_first = false;
    }
    list(search, group, open);
    if (search.count > Search::enough) test_listed(search);
    return;
  }
  for (open &= ~now; (now | open) != 0; now = open, open = 0)
    for (; now != 0; now &= now - 1) {
      const auto i = static_cast<std::size_t>(__builtin_ctz(now));
      if (queries_for(boxes, i, search, bounds_of(search)) != 0) search_group_16(search, level - 1, group * lanes + i);
      if (is_flooded(search)) return;
    }
}
}  // namespace

NearestPoint nearest(const CloudTree& tree, const float query[3], NearestPoint bound) {
  search_group(tree, tree.top, 0, query, bound);
  return bound;
}

void nearest_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) {
  Search search(tree, queries);
  for (std::size_t i = 0; i < lanes; ++i) search.best[i] = candidate(best.squared[i], NearestPoint::none);
  for (std::size_t i = 0; i < lanes; ++i)
    if (hints[i] != NearestPoint::none) test_leaf(search, hints[i] / lanes, i);
  if (!best.has_many_ties) {
    search_group_16(search, tree.top, 0);
    test_listed(search);
  }
  if (best.has_many_ties || is_flooded(search)) search_crowded(search);
  best.has_many_ties = is_flooded(search);
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::uint32_t number = leaf_of(search.best[i]);
    if (number == NearestPoint::none) continue;
    const Leaf& leaf = tree.leaves[number];
    best.squared[i] = squared_of(search.best[i]);
    const std::size_t lane = lane_at(leaf, queries, i, best.squared[i]);
    best.point[i] = leaf.point[lane];
    best.slot[i] = static_cast<std::uint32_t>(number * lanes + lane);
  }
}

void project(const float* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients) {
  for (std::size_t j = 0; j < rows; ++j) {
    const float* weights = projection + j * stride;
    Floats even{}, odd{};  // two sums: no addition waits for the previous one
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
  constexpr std::size_t modes_between_checks = 2 * lanes;
  Floats distances{};
  for (std::size_t j = 0; j < stride; j += lanes) {
    const Floats dx = load(e[0] + j) - load(sample + j), dy = load(e[1] + j) - load(sample + stride + j),
                 dz = load(e[2] + j) - load(sample + 2 * stride + j);
    distances += square_roots(dx * dx + dy * dy + dz * dz);
    if ((j + lanes) % modes_between_checks == 0 && !(sum(distances) < bound)) break;  // the sum only grows
  }
  return sum(distances);
}
}  // namespace lbea::LBEA_KERNELS
