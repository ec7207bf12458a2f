// The search of sixteen queries in a cloud where each of them has to test many leaves.
//
// A query must test each leaf whose box is not farther than its nearest point. In a cloud of a surface these are few,
// except where many points are equally distant up to the size of a leaf's box, or up to rounding. Points equally
// distant from K vertices are on a sphere (K = 1), on a ring (K vertices on a line), or in two places (otherwise). So
// the worst clouds need about K n / 16 tests of leaves for n points; nothing known before the test excludes one of
// them. most_hard_tests() limits that.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/kernels/lanes.hpp"

namespace lbea::LBEA_KERNELS {
namespace {
constexpr float infinity = __builtin_inff(), largest_finite = 3.4028234e38f;

// Sixteen queries near each other.
struct Queries {
  const CloudTree& tree;
  const float* const* planes;
  Floats x, y, z;
  float low[3], high[3];  // their common box

  Queries(const CloudTree& cloud, const float* const positions[3])
      : tree(cloud), planes(positions), x(load(positions[0])), y(load(positions[1])), z(load(positions[2])) {
    const Floats* const coordinates[3] = {&x, &y, &z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = least(*coordinates[axis]);
      high[axis] = greatest(*coordinates[axis]);
    }
  }
};

// An ordinary search resolves fewer ties and tests fewer leaves.
constexpr std::uint32_t many_ties = 8, many_tests = 512;
bool is_hard(const CloudTree& tree, std::uint32_t ties, std::uint32_t tests) {
  return tests >= many_tests || (ties >= many_ties && tree.is_crowded);
}

// Squared distances of boxes from a query.
__attribute__((always_inline)) inline Floats squared_distances(const BoxGroup& group, const float query[3]) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats outward = maximum(load(group.low[axis]) - query[axis], query[axis] - load(group.high[axis]));
    const Floats beyond = maximum(outward, Floats{});
    squared += beyond * beyond;
  }
  return squared;
}

// Squared distances of the queries from a box.
__attribute__((always_inline)) inline Floats squared_distances(const BoxGroup& group, std::size_t i,
                                                               const Queries& queries) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats& position = axis == 0 ? queries.x : axis == 1 ? queries.y : queries.z;
    const Floats outward = maximum(maximum(group.low[axis][i] - position, position - group.high[axis][i]), Floats{});
    squared += outward * outward;
  }
  return squared;
}

// Squared distances of the boxes from the queries' common box.
Floats squared_gaps(const BoxGroup& group, const Queries& queries) {
  Floats squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Floats gap = maximum(
        maximum(load(group.low[axis]) - queries.high[axis], queries.low[axis] - load(group.high[axis])), Floats{});
    squared += gap * gap;
  }
  return squared;
}

// The search in a cloud of which each query tests many leaves: the queries go through the tree together, and each tests
// all its leaves below one box in a row. Each lane keeps the best of its points, by distance and then by place in the
// frame, so that neither ties nor nearer points need a branch.
struct HardSearch {
  static constexpr std::uint32_t all_queries = 0xffff;
  static constexpr std::int32_t no_point = 0x7fff'ffff;

  const Queries& queries;
  std::uint32_t ties = 0, tests = 0;
  // Per query: the best of each lane.
  Floats squared[lanes];
  Ints place[lanes], leaf[lanes];
  // Per query: the best of all.
  float bounds[lanes];
  std::int32_t places[lanes];  // in the frame, or no_point

  HardSearch(const Queries& sixteen, const float* largest) : queries(sixteen) {
    for (std::size_t q = 0; q < lanes; ++q) {
      bounds[q] = largest[q] < largest_finite ? largest[q] : largest_finite;
      places[q] = no_point;
      squared[q] = all(bounds[q]);
      place[q] = leaf[q] = all_of(no_point);
    }
  }
};

__attribute__((always_inline)) inline void update_best(HardSearch& hard, std::size_t query) {
  const Floats bound = all(least(hard.squared[query]));
  std::int32_t place[lanes], lowest = HardSearch::no_point;
  store(place, choose(hard.squared[query] <= bound, hard.place[query], all_of(HardSearch::no_point)));
  for (const std::int32_t each : place) lowest = each < lowest ? each : lowest;
  hard.bounds[query] = bound[0];
  hard.places[query] = lowest;
}

// There must be a best point.
std::uint32_t leaf_of_best(const HardSearch& hard, std::size_t query) {
  std::int32_t place[lanes], leaf[lanes];
  store(place, hard.place[query]);
  store(leaf, hard.leaf[query]);
  std::size_t i = 0;
  while (place[i] != hard.places[query]) ++i;
  return static_cast<std::uint32_t>(leaf[i]);
}

// Tests leaf first + i for every bit i of `open`.
void test_leaves(HardSearch& hard, std::size_t query, std::uint32_t first, std::uint32_t open) {
  const float* const* const planes = hard.queries.planes;
  const float x = planes[0][query], y = planes[1][query], z = planes[2][query];
  const Floats bound = all(hard.bounds[query]);
  Floats squared = hard.squared[query];
  Ints place = hard.place[query], leaf = hard.leaf[query];
  hard.tests += static_cast<std::uint32_t>(__builtin_popcount(open));
  for (; open != 0; open &= open - 1) {
    const std::uint32_t number = first + static_cast<std::uint32_t>(__builtin_ctz(open));
    const Leaf& points = hard.queries.tree.leaves[number];
    const Floats dx = x - load(points.x), dy = y - load(points.y), dz = z - load(points.z);
    const Floats distances = dx * dx + dy * dy + dz * dz;
    if (at_most(distances, bound) == 0) continue;
    const Ints places = loaded<Ints>(points.point);
    const Ints is_better = (distances < squared) | ((distances <= squared) & (places < place));
    squared = choose(is_better, distances, squared);
    place = choose(is_better, places, place);
    leaf = choose(is_better, all_of(static_cast<std::int32_t>(number)), leaf);
  }
  hard.squared[query] = squared, hard.place[query] = place, hard.leaf[query] = leaf;
  update_best(hard, query);
}

// Bit i: distance i is below bound i, or equal to it and the box has a point that comes before the best one.
__attribute__((always_inline)) inline std::uint32_t may_improve(HardSearch& hard, const Floats& distances,
                                                                const Floats& bounds, const Ints& first,
                                                                const Ints& places) {
  const std::uint32_t open = at_most(distances, bounds), ties = open & at_most(bounds, distances);
  if (ties == 0 || !hard.queries.tree.is_crowded) return open;
  ++hard.ties;
  return open & (~ties | differing(first < places, Ints{}));
}

__attribute__((always_inline)) inline void search_leaves(HardSearch& hard, std::size_t group, std::size_t query) {
  const CloudTree& tree = hard.queries.tree;
  const float* const* const planes = hard.queries.planes;
  const float position[3] = {planes[0][query], planes[1][query], planes[2][query]};
  const std::uint32_t open =
      may_improve(hard, squared_distances(tree.groups[0][group], position), all(hard.bounds[query]),
                  loaded<Ints>(tree.first[0] + group * lanes), all_of(hard.places[query]));
  if (open != 0) test_leaves(hard, query, static_cast<std::uint32_t>(group * lanes), open);
}

// The nearest box; of equally near ones that with the first point of the frame.
std::size_t nearest_box(const CloudTree& tree, std::size_t level, std::size_t group, const float position[3]) {
  const Floats distances = squared_distances(tree.groups[level][group], position);
  std::uint32_t ties = at_most(distances, all(least(distances)));
  auto nearest = static_cast<std::size_t>(__builtin_ctz(ties));
  if (!tree.is_crowded) return nearest;
  const std::uint32_t* const first = tree.first[level] + group * lanes;
  for (ties &= ties - 1; ties != 0; ties &= ties - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(ties));
    if (first[i] < first[nearest]) nearest = i;
  }
  return nearest;
}

// For a good bound: the leaves below the nearest boxes.
void descend(HardSearch& hard, std::size_t query) {
  const CloudTree& tree = hard.queries.tree;
  const float* const* const planes = hard.queries.planes;
  const float position[3] = {planes[0][query], planes[1][query], planes[2][query]};
  std::size_t group = 0;
  for (std::size_t level = tree.top; level > 0; --level)
    group = group * lanes + nearest_box(tree, level, group, position);
  search_leaves(hard, group, query);
}

// The nearest box first, then the others in their order.
void search_below(HardSearch& hard, std::size_t level, std::size_t group, std::uint32_t queries) {
  if (level == 0) {
    for (; queries != 0; queries &= queries - 1)
      search_leaves(hard, group, static_cast<std::size_t>(__builtin_ctz(queries)));
    return;
  }
  const CloudTree& tree = hard.queries.tree;
  const BoxGroup& boxes = tree.groups[level][group];
  const Floats gaps = squared_gaps(boxes, hard.queries);
  std::uint32_t open = at_most(gaps, all(greatest(load(hard.bounds))));
  std::uint32_t now = at_most(gaps, all(least(gaps))) & open;
  for (open &= ~now; (now | open) != 0; now = open, open = 0)
    for (; now != 0; now &= now - 1) {
      const auto i = static_cast<std::size_t>(__builtin_ctz(now));
      const auto first = static_cast<std::int32_t>(tree.first[level][group * lanes + i]);
      const std::uint32_t near = queries & may_improve(hard, squared_distances(boxes, i, hard.queries),
                                                       load(hard.bounds), all_of(first), loaded<Ints>(hard.places));
      if (near != 0) search_below(hard, level - 1, group * lanes + i, near);
    }
}

// hints: a leaf for each query, or NearestPoint::none.
void search_hard(HardSearch& hard, const std::uint32_t* hints) {
  for (std::size_t q = 0; q < lanes; ++q) {
    if (hints[q] != NearestPoint::none) test_leaves(hard, q, hints[q], 1);
    if (q > 0 && hard.places[q - 1] != HardSearch::no_point) test_leaves(hard, q, leaf_of_best(hard, q - 1), 1);
    descend(hard, q);
  }
  search_below(hard, hard.queries.tree.top, 0, HardSearch::all_queries);
}
}  // namespace
}  // namespace lbea::LBEA_KERNELS
