// The depth images for Method::fit: those of the model if they fit the rig's pose, otherwise rendered at the start.
#pragma once

#include "precompute/parallel.hpp"
#include "precompute/rig/stereo_sensor.hpp"

namespace lbea::tool {

/// Whether frames from the pose `wanted` can be compared with images rendered for `baked`: the poses differ so little
/// that both see the same surface.
[[nodiscard]] bool suits(const RigidTransform& baked, const RigidTransform& wanted,
                         std::string_view length_unit) noexcept;

/// Whether the model has depth images that suit this pose.
[[nodiscard]] bool has_images_for(const RigidTransform& T_reference_sensor, const Model& model);

/// Throws Error{bad_input} if the program is to stop meanwhile.
[[nodiscard]] SensorViews rendered_until_stop(const std::function<SensorViews(const bake::Workers&)>& render);

/// Renders the images of all samples for a rig, and learns from them what the bake learns from its own.
[[nodiscard]] SensorViews rendered(const Model& model, const bake::StereoSensor& sensor);

/// Empty unless the method is fit. `sensor_json`: the text of the rig's description, which may be empty when the
/// model's own images are used; `name`: its file, for errors. Throws Error{bad_config | bad_input} when images are
/// needed and cannot be rendered.
[[nodiscard]] SensorViews views_for(const MatcherConfig& config, const Model& model, const std::string& sensor_json,
                                    const std::string& name);

}  // namespace lbea::tool
