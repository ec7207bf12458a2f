#include "tools/register/undeformed.hpp"

#include "adapters/files/atomic_file.hpp"
#include "precompute/registration/alignment.hpp"
#include "precompute/rig/virtual_sensor.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>

namespace lbea::tool {
namespace {

nlohmann::ordered_json rows(const RigidTransform& T) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < 3; ++i)
    rows.push_back({double{T[4 * i]}, double{T[4 * i + 1]}, double{T[4 * i + 2]}, double{T[4 * i + 3]}});
  return rows;
}

}  // namespace

Undeformed undeformed_component(const Model& model, double least_variation) {
  double earliest = std::numeric_limits<double>::infinity();
  for (std::uint32_t s = 0; s < model.samples(); ++s) earliest = std::min(earliest, model.sample_time_s(s));
  std::vector<std::span<const float>> shapes;
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    if (model.sample_time_s(s) <= earliest) shapes.push_back(model.node_positions(s));
  Undeformed component{bake::shape_modes(shapes, least_variation), {}};
  component.elements.resize(model.elements());
  for (std::size_t i = 0; i < model.element_nodes().size(); ++i)
    component.elements[i / 4][i % 4] = model.element_nodes()[i];
  return component;
}

decltype(bake::ReferenceSurface::visible) visibility_of(const Undeformed& component, const io::SensorDescription& rig) {
  return [&component, rig](const RigidTransform& pose) {
    const bake::VirtualSensor sensor(moved_to(rig.sensor, pose), component.shape.mean.size() / 3, component.elements);
    return sensor.visible_elements({component.shape.mean}, rig.noise.min_cos_incidence);
  };
}

bake::StereoSensor moved_to(const bake::StereoSensor& rig, const RigidTransform& T_reference_sensor) {
  bake::StereoSensor moved = rig;
  const Eigen::Isometry3d T_sensor_right =
      bake::to_isometry(rig.T_reference_sensor).inverse() * bake::to_isometry(rig.T_reference_right);
  moved.T_reference_sensor = T_reference_sensor;
  moved.T_reference_right = bake::to_transform(bake::to_isometry(T_reference_sensor) * T_sensor_right);
  return moved;
}

std::string with_poses(const std::filesystem::path& sensor_json, const bake::StereoSensor& rig) {
  const auto bytes = io::read_file(sensor_json);
  auto json = nlohmann::ordered_json::parse(io::as_text(bytes));
  json["T_reference_sensor"] = rows(rig.T_reference_sensor);
  json["sensor"]["T_reference_right"] = rows(rig.T_reference_right);
  return json.dump(1) + '\n';
}

}  // namespace lbea::tool
