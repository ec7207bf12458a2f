// Pixels of meshes and clouds; the nearest to the sensor covers the others.
#include "tools/report/drawing/view.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

using Place = View::Place;

/// A picture with the depth of each pixel.
class Canvas {
 public:
  explicit Canvas(const View& view)
      : picture_(view.width(), view.height(), white),
        depths_(picture_.pixels.size(), std::numeric_limits<double>::infinity()) {}

  void paint(std::int64_t column, std::int64_t line, double depth, const io::Color& color) {
    if (column < 0 || line < 0 || column >= picture_.width || line >= picture_.height) return;
    const auto at = static_cast<std::size_t>(line) * picture_.width + static_cast<std::size_t>(column);
    if (depth >= depths_[at]) return;
    depths_[at] = depth;
    picture_.pixels[at] = color;
  }
  void paint_triangle(const std::array<Place, 3>& corners, const io::Color& color);
  [[nodiscard]] io::Picture take() { return std::move(picture_); }
  [[nodiscard]] double width() const { return picture_.width; }
  [[nodiscard]] double height() const { return picture_.height; }

 private:
  io::Picture picture_;
  std::vector<double> depths_;
};

bool is_finite(const Place& place) { return std::isfinite(place.column + place.line + place.depth); }

/// Twice the area of a triangle, with sign.
double area(const Place& a, const Place& b, double column, double line) {
  return (b.column - a.column) * (line - a.line) - (b.line - a.line) * (column - a.column);
}

void Canvas::paint_triangle(const std::array<Place, 3>& c, const io::Color& color) {
  const double whole = area(c[0], c[1], c[2].column, c[2].line);
  if (whole == 0 || !is_finite(c[0]) || !is_finite(c[1]) || !is_finite(c[2])) return;
  const auto [left, right] = std::minmax({c[0].column, c[1].column, c[2].column});
  const auto [top, bottom] = std::minmax({c[0].line, c[1].line, c[2].line});
  const auto first = [](double at) { return static_cast<std::int64_t>(std::floor(std::max(at, 0.0))); };
  const auto last = [](double at, double size) { return static_cast<std::int64_t>(std::ceil(std::min(at, size))); };
  constexpr double tolerance = -1e-9;
  for (std::int64_t line = first(top); line <= last(bottom, height()); ++line)
    for (std::int64_t column = first(left); column <= last(right, width()); ++column) {
      const double x = static_cast<double>(column) + 0.5, y = static_cast<double>(line) + 0.5;
      const double w0 = area(c[1], c[2], x, y) / whole, w1 = area(c[2], c[0], x, y) / whole, w2 = 1 - w0 - w1;
      if (w0 < tolerance || w1 < tolerance || w2 < tolerance) continue;
      paint(column, line, w0 * c[0].depth + w1 * c[1].depth + w2 * c[2].depth, color);
    }
}

/// Darker where the surface is seen obliquely.
io::Color shaded(const io::Color& color, double facing) {
  constexpr double ambient = 0.55;
  io::Color result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = static_cast<std::uint8_t>(color[k] * (ambient + (1 - ambient) * facing));
  return result;
}

std::array<double, 3> normal_of(const std::array<Point, 3>& c) {
  const std::array<double, 3> a{double{c[1].x} - double{c[0].x}, double{c[1].y} - double{c[0].y},
                                double{c[1].z} - double{c[0].z}},
      b{double{c[2].x} - double{c[0].x}, double{c[2].y} - double{c[0].y}, double{c[2].z} - double{c[0].z}};
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace

io::Picture picture_of_mesh(const View& view, std::span<const float> positions,
                            std::span<const std::array<std::uint32_t, 4>> elements, std::span<const io::Color> colors) {
  Canvas canvas(view);
  const auto point = [&](std::uint32_t node) {
    return Point{positions[3 * std::size_t{node}], positions[3 * std::size_t{node} + 1],
                 positions[3 * std::size_t{node} + 2]};
  };
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const std::size_t middle : {1u, 2u}) {  // a quad is split along its corners 0 and 2
      const auto& nodes = elements[e];
      if (nodes[middle] == nodes[middle + 1]) continue;  // the second half of a triangle
      const std::array<Point, 3> corners{point(nodes[0]), point(nodes[middle]), point(nodes[middle + 1])};
      canvas.paint_triangle({view.place_of(corners[0]), view.place_of(corners[1]), view.place_of(corners[2])},
                            shaded(colors[e], view.facing(normal_of(corners))));
    }
  return canvas.take();
}

io::Picture picture_of_cloud(const View& view, std::span<const Point> points, std::span<const io::Color> colors) {
  Canvas canvas(view);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Place place = view.place_of(points[i]);
    if (!is_finite(place) || std::abs(place.column) > 1e6 || std::abs(place.line) > 1e6) continue;
    const auto column = static_cast<std::int64_t>(std::floor(place.column)),
               line = static_cast<std::int64_t>(std::floor(place.line));
    for (const std::int64_t dx : {0, 1})
      for (const std::int64_t dy : {0, 1}) canvas.paint(column + dx, line + dy, place.depth, colors[i]);
  }
  return canvas.take();
}

}  // namespace lbea::tool
