#include "precompute/branches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace lbea {

namespace {

double mean_distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3)
    sum += std::hypot(double{a[i]} - double{b[i]}, double{a[i + 1]} - double{b[i + 1]}, double{a[i + 2]} - double{b[i + 2]});
  return sum / std::max(1.0, static_cast<double>(a.size() / 3));
}

struct Join {
  std::size_t into, from;
  double height;
};

// Average linkage; the groups' distances are updated as weighted means (Lance and Williams).
std::vector<Join> joins(std::span<const std::vector<float>> rows) {
  const std::size_t n = rows.size();
  std::vector<std::vector<double>> distance(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j) distance[i][j] = distance[j][i] = mean_distance(rows[i], rows[j]);
  std::vector<double> size(n, 1);
  std::vector<Join> order;
  for (std::size_t left = n; left > 1; --left) {
    Join best{0, 0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n && size[i] > 0; ++j)
        if (size[j] > 0 && distance[i][j] < best.height) best = {i, j, distance[i][j]};
    if (!(best.height < std::numeric_limits<double>::infinity())) break;  // positions that are not finite join nothing
    order.push_back(best);
    for (std::size_t k = 0; k < n; ++k)
      distance[best.into][k] = distance[k][best.into] =
          (size[best.into] * distance[best.into][k] + size[best.from] * distance[best.from][k]) / (size[best.into] + size[best.from]);
    size[best.into] += size[best.from];
    size[best.from] = 0;
  }
  return order;
}

// How many joins stand below the cut. Heights of average linkage ascend.
std::size_t joins_within_branches(const std::vector<Join>& order) {
  constexpr double clear_gap = 1.4;
  constexpr std::size_t most_branches = 8;
  std::size_t kept = order.size();
  double widest = clear_gap;
  for (std::size_t i = order.size() > most_branches ? order.size() - most_branches : 1; i < order.size(); ++i) {
    const double gap = order[i].height / std::max(order[i - 1].height, 1e-12);
    if (gap >= widest) {
      widest = gap;
      kept = i;
    }
  }
  return kept;
}

}  // namespace

std::vector<std::uint32_t> deformation_branches(std::span<const std::vector<float>> last_states) {
  const std::vector<Join> order = joins(last_states);
  std::vector<std::size_t> group(last_states.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t i = 0; i < joins_within_branches(order); ++i) std::ranges::replace(group, order[i].from, order[i].into);
  std::vector<std::uint32_t> branch(group.size());
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const auto place = std::ranges::find(seen, group[i]) - seen.begin();
    if (static_cast<std::size_t>(place) == seen.size()) seen.push_back(group[i]);
    branch[i] = static_cast<std::uint32_t>(place);
  }
  return branch;
}

}  // namespace lbea
