// The searches: nearest points of a cloud to one query and to sixteen at once; coefficients and their distances.
// Compiled once per instruction set, like kernel_code.cpp.
#include "runtime/src/kernels/hard_search.hpp"

namespace lbea::LBEA_KERNELS {
namespace {
void search_leaf(const Leaf& leaf, const float query[3], NearestPoint& best) {
  const Floats dx = load(leaf.x) - query[0], dy = load(leaf.y) - query[1], dz = load(leaf.z) - query[2];
  const Floats squared = dx * dx + dy * dy + dz * dz;
  for (std::uint32_t bits = at_most(squared, all(best.squared)); bits != 0; bits &= bits - 1) {
    const auto i = static_cast<std::size_t>(__builtin_ctz(bits));
    if (squared[i] > best.squared || (squared[i] == best.squared && leaf.point[i] >= best.point)) continue;
    best = {leaf.point[i], squared[i], leaf.x[i], leaf.y[i], leaf.z[i]};
  }
}

// Tests the leaves that may hold a point within the bound, the nearest box first. A box exactly at the bound may hold
// an equally near point that comes first in the frame. test(leaf) returns the new bound; a negative one ends it all.
template <typename Test>
__attribute__((noinline)) void visit_leaves(const CloudTree& tree, std::size_t level, std::size_t group,
                                            const float query[3], float& bound, const Test& test) {
  Floats distances = squared_distances(tree.groups[level][group], query);
  for (float squared = least(distances); squared <= bound && squared <= largest_finite; squared = least(distances)) {
    const Ints is_next = distances <= all(squared);
    distances = choose(is_next, all(infinity), distances);
    for (std::uint32_t next = differing(is_next, Ints{}); next != 0 && squared <= bound; next &= next - 1) {
      const std::size_t child = group * lanes + static_cast<std::size_t>(__builtin_ctz(next));
      if (level == 0)
        bound = test(child);
      else
        visit_leaves(tree, level - 1, child, query, bound, test);
    }
  }
}

// The search of sixteen queries. Which leaves a query must test is hard to predict, so (leaf, query) pairs are listed
// first and then tested in one loop without branches.
struct Search : Queries {
  static constexpr std::size_t enough = 24;  // listed pairs after which testing them pays off: it lowers the bounds

  std::uint64_t best[lanes];  // bits of the squared distance, then the leaf: a nearer candidate is a smaller number
  bool is_first = true;       // no leaf but those of the hints has been tested
  std::uint32_t ties = 0, tests = 0;  // resolved, tested so far
  std::uint64_t placed[lanes] = {};   // the value of `best` for which `place` holds the place in the frame
  std::uint32_t place[lanes];
  std::size_t count = 0;
  std::uint32_t listed[enough + lanes * lanes + lanes];  // leaf * 16 + query

  using Queries::Queries;
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
  search.tests += static_cast<std::uint32_t>(search.count);
  for (std::size_t i = 0; i < search.count; ++i)
    test_leaf(search, static_cast<std::uint32_t>(search.listed[i] / lanes), search.listed[i] % lanes);
  search.count = 0;
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

bool is_hard(const Search& search) { return is_hard(search.tree, search.ties, search.tests); }

// Groups of queries for which an ordinary search suffices spend nothing, even if the previous group was hard.
void spend(NearestPoints& best, std::uint32_t tests) {
  if (best.tests_left == NearestPoints::unlimited || tests <= many_tests) return;
  const std::uint32_t spent = tests - many_tests;
  best.tests_left -= spent < best.tests_left ? spent : best.tests_left;
}

// Returns whether this was hard, too.
__attribute__((noinline)) bool search_again(Search& search, NearestPoints& best) {
  std::uint32_t hints[lanes];
  for (std::size_t i = 0; i < lanes; ++i) hints[i] = leaf_of(search.best[i]);
  HardSearch hard(search, best.squared);
  search_hard(hard, hints);
  for (std::size_t i = 0; i < lanes; ++i)
    if (hard.places[i] != HardSearch::no_point) search.best[i] = candidate(hard.bounds[i], leaf_of_best(hard, i));
  spend(best, hard.tests);
  return is_hard(search.tree, hard.ties, hard.tests);
}

// Each query tests only the first leaves of a search for it alone. Returns whether that ended one before its end.
__attribute__((noinline)) bool search_briefly(Search& search) {
  constexpr std::uint32_t most_tests = 16;
  bool is_incomplete = false;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float query[3] = {search.planes[0][i], search.planes[1][i], search.planes[2][i]};
    float bound = squared_of(search.best[i]);
    std::uint32_t tests = 0;
    visit_leaves(search.tree, search.tree.top, 0, query, bound, [&](std::size_t leaf) {
      const Floats distances = squared_distances(search.tree.leaves[leaf], search.planes, i);
      const std::uint64_t found = candidate(least(distances), static_cast<std::uint32_t>(leaf));
      search.best[i] = found < search.best[i] ? found : search.best[i];
      return ++tests < most_tests ? squared_of(search.best[i]) : -1.0f;
    });
    is_incomplete |= bound < 0;
  }
  return is_incomplete;
}

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
      if (is_hard(search)) return;
    }
}

Floats weights_at(const float* from) { return load(from); }
Floats weights_at(const std::uint16_t* from) { return to_floats(load_shorts(from) - (1 << 15)); }

template <typename Number>
void project_rows(const Number* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients) {
  for (std::size_t j = 0; j < rows; ++j) {
    const Number* row = projection + j * stride;
    Floats even{}, odd{};  // two sums: no addition waits for the previous one
    std::size_t i = 0;
    for (; i + 2 * lanes <= stride; i += 2 * lanes) {
      even += weights_at(row + i) * load(f + i);
      odd += weights_at(row + i + lanes) * load(f + i + lanes);
    }
    if (i < stride) even += weights_at(row + i) * load(f + i);
    coefficients[j] = sum(even + odd);
  }
}
}  // namespace

NearestPoint nearest(const CloudTree& tree, const float query[3], NearestPoint bound) {
  float squared = bound.squared;
  visit_leaves(tree, tree.top, 0, query, squared, [&](std::size_t leaf) {
    search_leaf(tree.leaves[leaf], query, bound);
    return bound.squared;
  });
  return bound;
}

void nearest_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best) {
  Search search(tree, queries);
  for (std::size_t i = 0; i < lanes; ++i) search.best[i] = candidate(best.squared[i], NearestPoint::none);
  for (std::size_t i = 0; i < lanes; ++i)
    if (hints[i] != NearestPoint::none) test_leaf(search, hints[i] / lanes, i);
  if (!best.is_hard) {
    search_group_16(search, tree.top, 0);
    test_listed(search);
    best.is_hard = is_hard(search);
  }
  best.is_cut = best.is_hard && best.tests_left == 0;
  if (best.is_hard) best.is_hard = best.is_cut ? search_briefly(search) : search_again(search, best);
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
  project_rows(projection, rows, stride, f, coefficients);
}

void project_short(const std::uint16_t* projection, std::size_t rows, std::size_t stride, const float* f,
                   float* coefficients) {
  project_rows(projection, rows, stride, f, coefficients);
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
