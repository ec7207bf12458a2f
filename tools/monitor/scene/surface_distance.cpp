#include "tools/monitor/scene/surface_distance.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::int64_t most_cells = 128;  // along an axis

Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point moved(const Point& a, const Point& along, float by) {
  return {a.x + along.x * by, a.y + along.y * by, a.z + along.z * by};
}

float to_segment(const Point& p, const Point& a, const Point& b) {
  const Point ab = b - a, ap = p - a;
  const float length = dot(ab, ab);
  const Point foot = moved(a, ab, length > 0 ? std::clamp(dot(ap, ab) / length, 0.0f, 1.0f) : 0.0f);
  return dot(p - foot, p - foot);
}

/// Squared. Inside the prism over the triangle the distance from its plane, else from the nearest edge.
float to_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  const Point ab = b - a, ac = c - a, ap = p - a;
  const float d00 = dot(ab, ab), d01 = dot(ab, ac), d11 = dot(ac, ac), d20 = dot(ap, ab), d21 = dot(ap, ac);
  const float determinant = d00 * d11 - d01 * d01;
  if (determinant > 0) {
    const float v = (d11 * d20 - d01 * d21) / determinant, w = (d00 * d21 - d01 * d20) / determinant;
    if (v >= 0 && w >= 0 && v + w <= 1) {
      const Point foot = moved(moved(a, ab, v), ac, w);
      return dot(p - foot, p - foot);
    }
  }
  return std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
}

/// Counting sort: from keys to the places where each key's members begin, and the members.
void group(std::span<const std::uint32_t> keys, std::size_t groups, std::vector<std::uint32_t>& first,
           std::vector<std::uint32_t>& members) {
  first.assign(groups + 1, 0);
  for (const std::uint32_t key : keys) ++first[key + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  members.resize(keys.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < keys.size(); ++i) members[next[keys[i]]++] = static_cast<std::uint32_t>(i);
}

}  // namespace

SurfaceDistance::SurfaceDistance(std::span<const std::uint32_t> element_nodes, std::uint32_t nodes)
    : element_nodes_(element_nodes), nodes_(nodes) {
  group(element_nodes, nodes, first_element_, elements_);
  for (std::uint32_t& corner : elements_) corner /= 4;
}

std::int64_t SurfaceDistance::cell_along(float value, std::size_t axis) const noexcept {
  const float cell = std::floor((value - lo_[axis]) / cell_);
  return static_cast<std::int64_t>(std::clamp(cell, -2.0f, static_cast<float>(most_cells) + 2.0f));
}

void SurfaceDistance::set_shape(std::span<const float> positions, float limit) {
  positions_ = positions;
  limit_ = limit;
  std::array<float, 3> hi{};
  for (std::size_t k = 0; k < 3; ++k) {
    lo_[k] = hi[k] = positions.empty() ? 0.0f : positions[k];
    for (std::size_t i = k; i < positions.size(); i += 3) {
      lo_[k] = std::min(lo_[k], positions[i]);
      hi[k] = std::max(hi[k], positions[i]);
    }
  }
  const float longest = std::max({hi[0] - lo_[0], hi[1] - lo_[1], hi[2] - lo_[2]});
  cell_ = std::max(limit, longest / static_cast<float>(most_cells - 1));
  for (std::size_t k = 0; k < 3; ++k) cells_[k] = cell_along(hi[k], k) + 1;
  std::vector<std::uint32_t> cell_of(nodes_);
  for (std::uint32_t i = 0; i < nodes_; ++i) {
    std::int64_t cell = 0;
    for (std::size_t k = 0; k < 3; ++k)
      cell = cell * cells_[k] + std::clamp<std::int64_t>(cell_along(positions[i * 3 + k], k), 0, cells_[k] - 1);
    cell_of[i] = static_cast<std::uint32_t>(cell);
  }
  group(cell_of, static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]), first_node_, sorted_nodes_);
}

SurfaceDistance::Nearest SurfaceDistance::nearest_node(const Point& point) const noexcept {
  Nearest nearest{nodes_, 4 * limit_ * limit_};
  const std::array<std::int64_t, 3> home{cell_along(point.x, 0), cell_along(point.y, 1), cell_along(point.z, 2)};
  const auto begin = [&](std::size_t k) { return std::clamp<std::int64_t>(home[k] - 1, 0, cells_[k]); };
  const auto end = [&](std::size_t k) { return std::clamp<std::int64_t>(home[k] + 2, 0, cells_[k]); };
  for (std::int64_t x = begin(0); x < end(0); ++x)
    for (std::int64_t y = begin(1); y < end(1); ++y) {
      // Cells along z lie side by side.
      const std::int64_t row = (x * cells_[1] + y) * cells_[2];
      const std::uint32_t last = begin(2) < end(2) ? first_node_[static_cast<std::size_t>(row + end(2))] : 0;
      for (std::uint32_t i = begin(2) < end(2) ? first_node_[static_cast<std::size_t>(row + begin(2))] : 0; i < last;
           ++i) {
        const float* at = positions_.data() + std::size_t{sorted_nodes_[i]} * 3;
        const Point d{point.x - at[0], point.y - at[1], point.z - at[2]};
        if (const float squared = dot(d, d); squared < nearest.squared) nearest = {sorted_nodes_[i], squared};
      }
    }
  return nearest;
}

float SurfaceDistance::to_elements(std::uint32_t node, const Point& point) const noexcept {
  const auto corner = [&](std::uint32_t element, std::uint32_t k) {
    const float* at = positions_.data() + std::size_t{element_nodes_[std::size_t{element} * 4 + k]} * 3;
    return Point{at[0], at[1], at[2]};
  };
  float squared = limit_ * limit_;
  for (std::uint32_t i = first_element_[node]; i < first_element_[node + 1]; ++i) {
    const Point a = corner(elements_[i], 0), b = corner(elements_[i], 1), c = corner(elements_[i], 2),
                d = corner(elements_[i], 3);
    squared = std::min({squared, to_triangle(point, a, b, c), to_triangle(point, a, c, d)});
  }
  return squared;
}

float SurfaceDistance::at(const Point& point) const noexcept {
  const Nearest nearest = nearest_node(point);
  return nearest.node < nodes_ ? std::sqrt(to_elements(nearest.node, point)) : limit_;
}

}  // namespace lbea::tool
