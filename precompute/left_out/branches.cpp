#include "precompute/left_out/branches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace lbea::bake {
namespace {

double mean_distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3)
    sum += std::hypot(double{a[i]} - double{b[i]}, double{a[i + 1]} - double{b[i + 1]},
                      double{a[i + 2]} - double{b[i + 2]});
  return sum / std::max(1.0, static_cast<double>(a.size() / 3));
}

struct Join {
  std::size_t into, from;
  double height;
};

using Distances = std::vector<std::vector<double>>;

Distances distances_between(std::span<const std::vector<float>> rows) {
  Distances distance(rows.size(), std::vector<double>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) distance[i][j] = distance[j][i] = mean_distance(rows[i], rows[j]);
  return distance;
}

// Average linkage; the groups' distances are updated as weighted means (Lance and Williams).
std::vector<Join> joins(Distances distance) {
  const std::size_t n = distance.size();
  std::vector<double> size(n, 1);
  std::vector<Join> order;
  for (std::size_t left = n; left > 1; --left) {
    Join best{0, 0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n && size[i] > 0; ++j)
        if (size[j] > 0 && distance[i][j] < best.height) best = {i, j, distance[i][j]};
    order.push_back(best);
    for (std::size_t k = 0; k < n; ++k)
      distance[best.into][k] = distance[k][best.into] =
          (size[best.into] * distance[best.into][k] + size[best.from] * distance[best.from][k]) /
          (size[best.into] + size[best.from]);
    size[best.into] += size[best.from];
    size[best.from] = 0;
  }
  return order;
}

std::vector<std::size_t> groups_after(const std::vector<Join>& order, std::size_t count, std::size_t n) {
  std::vector<std::size_t> group(n);
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t i = 0; i < count; ++i) std::ranges::replace(group, order[i].from, order[i].into);
  return group;
}

// Rousseeuw's silhouette of one row: how much nearer its own group is than the nearest other one; 0 for a group of one.
double silhouette(const Distances& distance, const std::vector<std::size_t>& group, std::size_t i) {
  std::vector<double> sum(group.size(), 0), count(group.size(), 0);
  for (std::size_t j = 0; j < group.size(); ++j) {
    if (j == i) continue;
    sum[group[j]] += distance[i][j];
    count[group[j]] += 1;
  }
  if (count[group[i]] == 0) return 0;
  const double own = sum[group[i]] / count[group[i]];
  double other = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < group.size(); ++g)
    if (g != group[i] && count[g] > 0) other = std::min(other, sum[g] / count[g]);
  return std::max(own, other) > 0 ? (other - own) / std::max(own, other) : 0;
}

double mean_silhouette(const Distances& distance, const std::vector<std::size_t>& group) {
  double sum = 0;
  for (std::size_t i = 0; i < group.size(); ++i) sum += silhouette(distance, group, i);
  return sum / static_cast<double>(group.size());
}

std::vector<std::size_t> best_groups(std::span<const std::vector<float>> rows) {
  constexpr double clear = 0.55;
  constexpr std::size_t most_branches = 8;
  const Distances distance = distances_between(rows);
  const std::vector<Join> order = joins(distance);
  std::vector<std::size_t> best(rows.size(), 0);
  double highest = clear;
  for (std::size_t branches = 2; branches <= most_branches && branches < rows.size(); ++branches) {
    auto group = groups_after(order, rows.size() - branches, rows.size());
    const double score = mean_silhouette(distance, group);
    if (score > highest) {
      highest = score;
      best = std::move(group);
    }
  }
  return best;
}

// The group whose rows are nearest on the average; ties to the lower one.
std::size_t nearest_group(const std::vector<float>& row, const std::vector<std::vector<float>>& rows,
                          const std::vector<std::size_t>& group) {
  std::vector<double> sum(rows.size(), 0), count(rows.size(), 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sum[group[i]] += mean_distance(row, rows[i]);
    count[group[i]] += 1;
  }
  std::size_t nearest = group.front();
  for (std::size_t g = 0; g < rows.size(); ++g)
    if (count[g] > 0 && sum[g] / count[g] < sum[nearest] / count[nearest]) nearest = g;
  return nearest;
}

// Numbered as they come.
std::vector<std::uint32_t> in_order(const std::vector<std::size_t>& group) {
  std::vector<std::uint32_t> branch(group.size());
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const auto place = std::ranges::find(seen, group[i]) - seen.begin();
    if (static_cast<std::size_t>(place) == seen.size()) seen.push_back(group[i]);
    branch[i] = static_cast<std::uint32_t>(place);
  }
  return branch;
}

}  // namespace

std::vector<float> thinned_rows(std::span<const float> values, std::size_t components, std::size_t most) {
  const std::size_t rows = values.size() / components, every = (rows + most - 1) / most;
  std::vector<float> chosen;
  for (std::size_t row = 0; row < rows; row += every) {
    const auto one = values.subspan(components * row, components);
    chosen.insert(chosen.end(), one.begin(), one.end());
  }
  return chosen;
}

std::vector<std::uint32_t> deformation_branches(std::span<const std::vector<float>> last_states) {
  return in_order(best_groups(last_states));
}

std::vector<std::uint32_t> deformation_branches(
    std::size_t simulations, const std::function<std::vector<float>(std::size_t simulation)>& last_state,
    std::size_t most_grouped) {
  const std::size_t every = std::max<std::size_t>(1, (simulations + most_grouped - 1) / most_grouped);
  std::vector<std::vector<float>> rows;
  for (std::size_t i = 0; i < simulations; i += every) rows.push_back(last_state(i));
  const std::vector<std::size_t> grouped = best_groups(rows);
  std::vector<std::size_t> group(simulations);
  for (std::size_t i = 0; i < simulations; ++i)
    group[i] = i % every == 0 ? grouped[i / every] : nearest_group(last_state(i), rows, grouped);
  return in_order(group);
}

}  // namespace lbea::bake
