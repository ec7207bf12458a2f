#include "precompute/rig/rig.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>

namespace lbea::bake::sensing {

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

}  // namespace lbea::bake::sensing
