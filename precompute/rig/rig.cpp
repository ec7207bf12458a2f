#include "precompute/rig/rig.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake::sensing {
namespace {
/// Share of the distance before a point within which nothing hides it: a surface must not hide itself by rounding.
constexpr double self_occlusion_tolerance = 1e-4;

void check_size(const Rig& rig, const SurfaceState& state) {
  const std::size_t coordinates = state.positions.size(), flags = state.alive.size();
  if (coordinates % 3 != 0 || coordinates / 3 != rig.nodes)
    throw Error{Status::bad_input, "a state of " + std::to_string(coordinates) +
                                       " coordinates does not fit a mesh of " + std::to_string(rig.nodes) + " nodes"};
  if (flags != 0 && flags != rig.elements)
    throw Error{Status::bad_input, "a state of " + std::to_string(flags) + " deletion flags does not fit a mesh of " +
                                       std::to_string(rig.elements) + " elements"};
}

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }
}  // namespace

Rig::Rig(const StereoSensor& description, std::size_t node_count, std::span<const std::array<std::uint32_t, 4>> quads)
    : sensor(description),
      plane(description),
      T_sensor_reference(to_pose(description.T_reference_sensor, "T_reference_sensor").inverse()),
      T_right_sensor(to_pose(description.T_reference_right, "T_reference_right").inverse() *
                     to_pose(description.T_reference_sensor, "T_reference_sensor")),
      right_eye(T_right_sensor.inverse().translation),
      nodes(node_count),
      elements(quads.size()) {
  if (elements >= no_element)
    throw Error{Status::bad_input, "a mesh of " + std::to_string(elements) + " elements is too large"};
  triangles.reserve(2 * elements);
  triangle_element.reserve(2 * elements);
  for (std::size_t element = 0; element < elements; ++element) add(static_cast<std::uint32_t>(element), quads[element]);
}

void Rig::add(std::uint32_t element, const std::array<std::uint32_t, 4>& quad) {
  for (const std::uint32_t node : quad)
    if (node >= nodes)
      throw Error{Status::bad_input, "element " + std::to_string(element) + " names node " + std::to_string(node) +
                                         ", but the mesh has only " + std::to_string(nodes) + " nodes"};
  triangles.push_back({quad[0], quad[1], quad[2]});
  triangle_element.push_back(element);
  if (quad[2] == quad[3]) return;
  triangles.push_back({quad[0], quad[2], quad[3]});
  triangle_element.push_back(element);
}

void PlacedMesh::place(const SurfaceState& state) {
  check_size(rig_, state);
  nodes_.clear();
  for (std::size_t i = 0; i < state.positions.size(); i += 3)
    nodes_.push_back(rig_.T_sensor_reference({state.positions[i], state.positions[i + 1], state.positions[i + 2]}));
  right_nodes_.resize(nodes_.size());
  std::ranges::transform(nodes_, right_nodes_.begin(), rig_.T_right_sensor);
  keep_live_triangles(state);
  left_.place(nodes_, triangles_);
  right_.place(right_nodes_, triangles_);
}

void PlacedMesh::keep_live_triangles(const SurfaceState& state) {
  triangles_.clear();
  element_.clear();
  for (std::size_t i = 0; i < rig_.triangles.size(); ++i) {
    const std::uint32_t element = rig_.triangle_element[i];
    if (!state.alive.empty() && state.alive[element] == 0) continue;
    if (!std::ranges::all_of(rig_.triangles[i], [&](std::uint32_t n) { return is_finite(nodes_[n]); })) continue;
    triangles_.push_back(rig_.triangles[i]);
    element_.push_back(element);
  }
}

Vec3 PlacedMesh::normal(const Triangle& triangle) const {
  const Vec3& corner = nodes_[triangle[0]];
  return cross(nodes_[triangle[1]] - corner, nodes_[triangle[2]] - corner);
}

std::span<const std::uint8_t> PlacedMesh::seen_from_left(std::span<const Vec3> points) {
  left_.seen(points, self_occlusion_tolerance, seen_left_);
  return seen_left_;
}

std::span<const std::uint8_t> PlacedMesh::seen_from_right(std::span<const Vec3> points) {
  right_points_.resize(points.size());
  std::ranges::transform(points, right_points_.begin(), rig_.T_right_sensor);
  right_.seen(right_points_, self_occlusion_tolerance, seen_right_);
  return seen_right_;
}

template <class Visit>
void PlacedMesh::see_from_left(double min_cos_incidence, const Visit& visit) {
  const PixelViews& views = left_.nearest();
  pixels_.clear();
  points_.clear();
  for (std::uint32_t row = 0; row < rig_.plane.height(); ++row) {
    const double y = rig_.plane.direction(0, row).y;
    const std::size_t first = row * views.stride;
    std::uint64_t last = no_triangle;
    Vec3 across;  // normal of the last triangle
    for (std::uint32_t column = 0; column < rig_.plane.width(); ++column) {
      const std::uint64_t triangle = views.triangle[first + column];
      if (triangle == no_triangle) continue;
      if (triangle != last) across = normal(triangles_[triangle]), last = triangle;
      const double depth = 1 / views.inverse_depth[first + column];
      visit(Pixel{column, row}, triangle, depth);
      const Vec3 point{depth * left_.directions()[column], depth * y, depth};
      if (!rig_.faces_both(point, across, min_cos_incidence)) continue;
      pixels_.push_back({column, row});
      points_.push_back(point);
    }
  }
}

void PlacedMesh::render(double min_cos_incidence, SensorImage& image) {
  image.width_px = rig_.plane.width();
  image.height_px = rig_.plane.height();
  image.depth.assign(rig_.plane.pixels(), std::numeric_limits<float>::quiet_NaN());
  image.element.assign(rig_.plane.pixels(), no_element);
  image.measured.assign(rig_.plane.pixels(), 0);
  const auto place = [&](const Pixel& pixel) { return std::size_t{pixel.row} * image.width_px + pixel.column; };
  see_from_left(min_cos_incidence, [&](const Pixel& pixel, std::uint64_t triangle, double depth) {
    image.depth[place(pixel)] = static_cast<float>(depth);
    image.element[place(pixel)] = element_[triangle];
  });
  const auto seen = seen_from_right(points_);
  for (std::size_t i = 0; i < pixels_.size(); ++i) image.measured[place(pixels_[i])] = seen[i];
}

MeasuredPixels PlacedMesh::measured(double min_cos_incidence) {
  see_from_left(min_cos_incidence, [](const Pixel&, std::uint64_t, double) {});
  return {pixels_, points_, seen_from_right(points_)};
}
}  // namespace lbea::bake::sensing
