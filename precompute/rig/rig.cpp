#include "precompute/rig/rig.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

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

std::vector<float> placed(const Rig& rig, const SurfaceState& state) {
  check_size(rig, state);
  std::vector<float> result;
  result.reserve(state.positions.size());
  for (std::size_t i = 0; i < state.positions.size(); i += 3) {
    const float* node = &state.positions[i];
    const Vec3 p = rig.T_sensor_reference({node[0], node[1], node[2]});
    for (const double value : {p.x, p.y, p.z}) result.push_back(static_cast<float>(value));
  }
  return result;
}

template <class Row>
void for_each_row(std::uint32_t rows, unsigned threads, const Row& row) {
  std::atomic<std::uint32_t> next = 0;
  const auto work = [&] {
    for (std::uint32_t index = next++; index < rows; index = next++) row(index);
  };
  std::vector<std::jthread> helpers;
  for (unsigned helper = 1; helper < threads; ++helper) helpers.emplace_back(work);
  work();
}
}  // namespace

Rig::Rig(const StereoSensor& description, std::size_t node_count, std::span<const std::array<std::uint32_t, 4>> quads,
         unsigned wanted_threads)
    : sensor(description),
      plane(description),
      T_sensor_reference(to_pose(description.T_reference_sensor, "T_reference_sensor").inverse()),
      T_right_sensor(to_pose(description.T_reference_right, "T_reference_right").inverse() *
                     to_pose(description.T_reference_sensor, "T_reference_sensor")),
      right_eye(T_right_sensor.inverse().translation),
      nodes(node_count),
      elements(quads.size()),
      threads(wanted_threads != 0 ? wanted_threads : std::max(1u, std::thread::hardware_concurrency())) {
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

bool Rig::faces_both(const Vec3& point, const Vec3& normal, double min_cos_incidence) const {
  const Vec3 from_right = point - right_eye;
  const double length = norm(normal);
  const double left = dot(normal, point) / (length * norm(point));
  const double right = dot(normal, from_right) / (length * norm(from_right));
  return left * right > 0 && std::abs(left) >= min_cos_incidence && std::abs(right) >= min_cos_incidence;
}

PlacedMesh::Live PlacedMesh::live_triangles(const Rig& rig, const SurfaceState& state) {
  if (state.alive.empty()) return {rig.triangles, rig.triangle_element};
  Live live;
  for (std::size_t i = 0; i < rig.triangles.size(); ++i) {
    if (state.alive[rig.triangle_element[i]] == 0) continue;
    live.triangles.push_back(rig.triangles[i]);
    live.element.push_back(rig.triangle_element[i]);
  }
  return live;
}

PlacedMesh::PlacedMesh(const Rig& rig, const SurfaceState& state)
    : rig_(rig),
      positions_(placed(rig, state)),
      live_(live_triangles(rig, state)),
      scene_(rig.device, positions_, live_.triangles) {}

Vec3 PlacedMesh::node(std::uint32_t index) const {
  const float* p = &positions_[std::size_t{3} * index];
  return {p[0], p[1], p[2]};
}

Vec3 PlacedMesh::normal(const Triangle& triangle) const {
  const Vec3 corner = node(triangle[0]);
  return cross(node(triangle[1]) - corner, node(triangle[2]) - corner);
}

bool PlacedMesh::hidden_from_left(const Vec3& point) const {
  return scene_.blocked(Vec3{}, point, self_occlusion_tolerance);
}

bool PlacedMesh::hidden_from_right(const Vec3& point) const {
  return scene_.blocked(rig_.right_eye, point, self_occlusion_tolerance);
}

SensorImage PlacedMesh::render(double min_cos_incidence) const {
  SensorImage image{rig_.plane.width(), rig_.plane.height(), {}, {}, {}};
  const std::size_t pixels = std::size_t{image.width_px} * image.height_px;
  image.depth.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  image.element.assign(pixels, no_element);
  image.measured.assign(pixels, 0);
  for_each_row(image.height_px, rig_.threads, [&](std::uint32_t row) { render_row(row, min_cos_incidence, image); });
  return image;
}

void PlacedMesh::render_row(std::uint32_t row, double min_cos_incidence, SensorImage& into) const {
  std::size_t pixel = std::size_t{row} * into.width_px;
  for (std::uint32_t column = 0; column < into.width_px; ++column, ++pixel) {
    const Vec3 direction = rig_.plane.direction(column, row);
    const auto hit = scene_.first_hit(Vec3{}, direction);
    if (!hit) continue;
    const double depth = hit->distance;  // the direction has z = 1
    const Vec3 point{depth * direction.x, depth * direction.y, depth};
    into.depth[pixel] = static_cast<float>(depth);
    into.element[pixel] = live_.element[hit->triangle];
    into.measured[pixel] = rig_.in_right_image(point) && rig_.faces_both(point, hit->normal, min_cos_incidence) &&
                           !hidden_from_right(point);
  }
}
}  // namespace lbea::bake::sensing
