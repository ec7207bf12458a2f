#include "precompute/mapping/reference_places.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {
using Vec = std::array<double, 3>;

/// From the diagonals; zero for an element without area.
Vec normal_of(const Vec& a, const Vec& b, const Vec& c, const Vec& d) {
  Vec ac{}, bd{};
  for (std::size_t i = 0; i < 3; ++i) ac[i] = c[i] - a[i], bd[i] = d[i] - b[i];
  Vec n{ac[1] * bd[2] - ac[2] * bd[1], ac[2] * bd[0] - ac[0] * bd[2], ac[0] * bd[1] - ac[1] * bd[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  for (double& value : n) value = length > 0 ? value / length : 0;
  return n;
}
}  // namespace

ReferencePlaces::ReferencePlaces(const SimulationMesh& mesh)
    : mesh_(mesh), elements_(mesh.elements.size() - mesh.touching), first_(mesh.nodes() + 1, 0) {
  for (std::size_t e = 0; e < elements_; ++e) {
    const Quad& q = mesh.elements[e];
    element_normals_.push_back(normal_of(position(q[0]), position(q[1]), position(q[2]), position(q[3])));
    for (const std::uint32_t node : q) ++first_[node + 1];
  }
  for (std::size_t node = 0; node < mesh.nodes(); ++node) first_[node + 1] += first_[node];
  parts_.resize(first_.back());
  normals_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  Vec low{}, high{};
  for (std::size_t e = 0; e < elements_; ++e)
    for (const std::uint32_t node : mesh.elements[e]) {
      const Vec p = position(node);
      const bool is_first = e == 0 && node == mesh.elements[0][0];
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = is_first ? p[i] : std::min(low[i], p[i]);
        high[i] = is_first ? p[i] : std::max(high[i], p[i]);
      }
      parts_[next[node]] = mesh.element_parts[e];
      normals_[next[node]++] = element_normals_[e];
    }
  for (std::size_t i = 0; i < 3; ++i) middle_[i] = (low[i] + high[i]) / 2;
  diagonal_ = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

Vec ReferencePlaces::position(std::uint32_t node) const noexcept {
  const float* p = &mesh_.positions[3 * std::size_t{node}];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

WantedPlace ReferencePlaces::node(std::size_t node) const noexcept {
  const std::size_t begin = first_[node], count = first_[node + 1] - begin;
  return {position(static_cast<std::uint32_t>(node)), std::span(parts_).subspan(begin, count),
          std::span(normals_).subspan(begin, count)};
}

WantedPlace ReferencePlaces::quarter(std::size_t element, std::size_t corner) const noexcept {
  const Quad& q = mesh_.elements[element];
  Vec point{};
  for (std::size_t k = 0; k < q.size(); ++k) {
    constexpr std::array<double, 4> shares{9.0 / 16, 3.0 / 16, 1.0 / 16, 3.0 / 16};  // bilinear at a quarter's middle
    const Vec p = position(q[(corner + k) % q.size()]);
    for (std::size_t i = 0; i < 3; ++i) point[i] += shares[k] * p[i];
  }
  const bool has_area = element_normals_[element] != Vec{};
  return {point, std::span(mesh_.element_parts).subspan(element, 1),
          std::span(element_normals_).subspan(element, has_area ? 1 : 0)};
}
}  // namespace lbea::bake
