#include "precompute/registration/surface_tree.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {
using Vec = std::array<double, 3>;

Vec minus(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Nearest place on a triangle, as barycentric shares: by the region of the plane in which the foot falls.
Vec nearest_shares(const Vec& p, const std::array<Vec, 3>& corners) {
  const Vec ab = minus(corners[1], corners[0]), ac = minus(corners[2], corners[0]), ap = minus(p, corners[0]);
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec bp = minus(p, corners[1]);
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const Vec cp = minus(p, corners[2]);
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double all = va + vb + vc;
  return {va / all, vb / all, vc / all};
}

double squared_distance(const Vec& p, const Vec& low, const Vec& high) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double outside = std::max({low[i] - p[i], p[i] - high[i], 0.0});
    sum += outside * outside;
  }
  return sum;
}

bool is_facing(const Vec& normal, const Facing& facing) {
  return facing.normals.empty() || std::ranges::any_of(facing.normals, [&](const Vec& wanted) {
           return std::abs(dot(normal, wanted)) >= facing.least_cosine;
         });
}

/// Whether is_facing() may hold for a normal in the box.
bool may_face(const Vec& low, const Vec& high, const Facing& facing) {
  return facing.normals.empty() || std::ranges::any_of(facing.normals, [&](const Vec& wanted) {
           double least = 0, most = 0;
           for (std::size_t i = 0; i < 3; ++i) {
             least += std::min(low[i] * wanted[i], high[i] * wanted[i]);
             most += std::max(low[i] * wanted[i], high[i] * wanted[i]);
           }
           return std::max(most, -least) >= facing.least_cosine;
         });
}

constexpr std::uint32_t leaf_size = 4;
}  // namespace

SurfaceTree::SurfaceTree(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
                         std::span<const std::uint8_t> kept) {
  const auto add = [&](std::size_t element, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    Triangle triangle{{}, {}, {a, b, c}, static_cast<std::uint32_t>(element)};
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle.nodes[k] >= positions.size() / 3)
        throw Error(Status::bad_input, "element " + std::to_string(element) + " names node " +
                                           std::to_string(triangle.nodes[k]) + ", but there are " +
                                           std::to_string(positions.size() / 3));
      for (std::size_t i = 0; i < 3; ++i)
        triangle.corners[k][i] = double{positions[3 * std::size_t{triangle.nodes[k]} + i]};
    }
    const Vec normal =
        cross(minus(triangle.corners[1], triangle.corners[0]), minus(triangle.corners[2], triangle.corners[0]));
    const double area = dot(normal, normal);
    if (!(area > 0 && std::isfinite(area))) return;
    for (std::size_t i = 0; i < 3; ++i) triangle.normal[i] = normal[i] / std::sqrt(area);
    triangles_.push_back(triangle);
  };
  for (std::size_t e = 0; e < elements.size(); ++e) {
    if (!kept.empty() && kept[e] == 0) continue;
    const auto& q = elements[e];
    add(e, q[0], q[1], q[2]);
    if (q[2] != q[3]) add(e, q[0], q[2], q[3]);
  }
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

void SurfaceTree::build(std::uint32_t first, std::uint32_t count) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr Vec low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  const auto widen = [](Vec& least, Vec& most, const Vec& by) {
    for (std::size_t i = 0; i < 3; ++i) {
      least[i] = std::min(least[i], by[i]);
      most[i] = std::max(most[i], by[i]);
    }
  };
  Branch branch{low, high, low, high, first, count, 0};
  for (std::uint32_t t = first; t < first + count; ++t) {
    for (const Vec& corner : triangles_[t].corners) widen(branch.low, branch.high, corner);
    widen(branch.normal_low, branch.normal_high, triangles_[t].normal);
  }
  const std::size_t self = branches_.size();
  branches_.push_back(branch);
  if (count <= leaf_size) return;
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (branch.high[i] - branch.low[i] > branch.high[axis] - branch.low[axis]) axis = i;
  const auto key = [axis](const Triangle& t) { return t.corners[0][axis] + t.corners[1][axis] + t.corners[2][axis]; };
  const auto begin = triangles_.begin() + first;
  std::stable_sort(begin, begin + count, [&](const Triangle& a, const Triangle& b) { return key(a) < key(b); });
  build(first, count / 2);
  branches_[self].right = static_cast<std::uint32_t>(branches_.size());
  build(first + count / 2, count - count / 2);
}

SurfacePlace SurfaceTree::nearest(const std::array<double, 3>& point, double reach, const Facing& facing) const {
  SurfacePlace best;
  double least = reach * reach;
  std::array<std::uint32_t, 128> open{};  // halving keeps the depth below 32
  std::size_t size = branches_.empty() ? 0 : 1;
  while (size > 0) {
    const std::uint32_t at = open[--size];
    const Branch& branch = branches_[at];
    if (squared_distance(point, branch.low, branch.high) > least) continue;
    if (!may_face(branch.normal_low, branch.normal_high, facing)) continue;
    if (branch.right != 0) {
      const Branch &left = branches_[at + 1], &right = branches_[branch.right];
      const bool left_first =
          squared_distance(point, left.low, left.high) <= squared_distance(point, right.low, right.high);
      open[size++] = left_first ? branch.right : at + 1;
      open[size++] = left_first ? at + 1 : branch.right;
      continue;
    }
    for (std::uint32_t t = branch.first; t < branch.first + branch.count; ++t) {
      const Triangle& triangle = triangles_[t];
      const Vec shares = nearest_shares(point, triangle.corners);
      Vec place{};
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) place[i] += shares[k] * triangle.corners[k][i];
      const Vec to = minus(point, place);
      const double squared = dot(to, to);
      if (squared > least || (best.found() && squared >= least) || !is_facing(triangle.normal, facing)) continue;
      least = squared;
      best = {triangle.element, triangle.nodes, shares, place, triangle.normal, std::sqrt(squared)};
    }
  }
  return best;
}
}  // namespace lbea::bake
