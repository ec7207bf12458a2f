// The component as a rig sees it before the impact, from a model.
#pragma once

#include "adapters/rig/sensor_json.hpp"
#include "precompute/registration/registration.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lbea::tool {

struct Undeformed {
  bake::ShapeModes shape;  // of the simulations' earliest samples, which differ by what was varied
  std::vector<std::array<std::uint32_t, 4>> elements;
};
/// least_variation: modes that move the nodes by less are left out, length unit.
[[nodiscard]] Undeformed undeformed_component(const Model& model, double least_variation);

/// What the rig sees of it from another pose. `rig`: its cameras' places relative to each other count.
[[nodiscard]] decltype(bake::ReferenceSurface::visible) visibility_of(const Undeformed& component,
                                                                      const io::SensorDescription& rig);

/// The rig with its left camera at the pose, the right one where it is relative to the left.
[[nodiscard]] bake::StereoSensor moved_to(const bake::StereoSensor& rig, const RigidTransform& T_reference_sensor);

/// The text of a sensor.json with both poses replaced by the rig's; all else stays.
[[nodiscard]] std::string with_poses(const std::filesystem::path& sensor_json, const bake::StereoSensor& rig);

}  // namespace lbea::tool
