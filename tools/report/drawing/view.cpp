#include "tools/report/drawing/view.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

using Vector = std::array<double, 3>;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double margin = 0.04;                              // of the width, on every side
constexpr double least_height = 0.3, greatest_height = 1.0;  // of the width

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector normalized(const Vector& v) {
  const double length = std::sqrt(dot(v, v));
  return length > 0 ? Vector{v[0] / length, v[1] / length, v[2] / length} : Vector{0, 0, 1};
}

}  // namespace

io::Color color_of(double share) {
  constexpr std::array<io::Color, 6> anchors{
      {{150, 200, 225}, {160, 165, 205}, {185, 115, 160}, {190, 60, 105}, {150, 15, 60}, {90, 0, 40}}};
  const double at = std::clamp(std::isfinite(share) ? share : 1.0, 0.0, 1.0) * (anchors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), anchors.size() - 2);
  io::Color color;
  for (std::size_t k = 0; k < 3; ++k) {
    const double a = anchors[below][k], b = anchors[below + 1][k];
    color[k] = static_cast<std::uint8_t>(std::lround(a + (at - static_cast<double>(below)) * (b - a)));
  }
  return color;
}

View::View(const RigidTransform& T, std::uint32_t width)
    : width_(width), low_{infinity, infinity, infinity}, high_{-infinity, -infinity, -infinity} {
  const auto axis = [&](std::size_t column) {
    return Vector{double{T[column]}, double{T[column + 4]}, double{T[column + 8]}};
  };
  right_ = axis(0);
  down_ = axis(1);
  forward_ = axis(2);
  if (T != identity_transform) return;
  forward_ = normalized({-1, 1.4, -1});
  right_ = normalized(cross(forward_, {0, 0, 1}));
  down_ = cross(forward_, right_);
}

Vector View::in_view(const Point& point) const {
  const Vector p{double{point.x}, double{point.y}, double{point.z}};
  return {dot(right_, p), dot(down_, p), dot(forward_, p)};
}

void View::include(std::span<const float> positions) {
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    const Vector at = in_view({positions[i], positions[i + 1], positions[i + 2]});
    if (!std::isfinite(at[0] + at[1] + at[2])) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], at[k]);
      high_[k] = std::max(high_[k], at[k]);
    }
  }
}

double View::scale() const {
  const double across = high_[0] - low_[0], along = high_[1] - low_[1];
  const double room = (1 - 2 * margin) * width_;
  if (!(across >= 0)) return 0;  // nothing is shown
  const double scale =
      std::min(across > 0 ? room / across : infinity, along > 0 ? greatest_height * room / along : infinity);
  return std::isfinite(scale) ? scale : 1;
}

std::uint32_t View::height() const {
  const double along = scale() > 0 ? (high_[1] - low_[1]) * scale() : 0;
  const double lines =
      std::clamp(along + 2 * margin * width_, least_height * width_, (greatest_height + 2 * margin) * width_);
  return static_cast<std::uint32_t>(lines);
}

View::Place View::place_of(const Point& point) const {
  const Vector at = in_view(point);
  const auto centered = [&](std::size_t k, std::uint32_t size) {
    return 0.5 * size + (at[k] - 0.5 * (low_[k] + high_[k])) * scale();
  };
  return {centered(0, width_), centered(1, height()), at[2]};
}

double View::facing(const Vector& normal) const { return std::abs(dot(forward_, normalized(normal))); }

}  // namespace lbea::tool
