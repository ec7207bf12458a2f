// The depth images that matching by fit needs: those of the model when they suit the rig, else rendered at the start.
#pragma once

#include <lbea/lbea.hpp>

#include <string>

namespace lbea::tool {

/// Whether frames from `wanted` can be compared with images rendered for `baked`: the pose differs so little that both
/// see the same surface.
[[nodiscard]] bool suits(const RigidTransform& baked, const RigidTransform& wanted) noexcept;

/// Empty unless the method is fit. pose_file: the rig's description; may be empty when the model's own images suit.
/// Throws Error{bad_config | bad_input} when images are needed and cannot be rendered.
[[nodiscard]] SensorViews views_for(const MatcherConfig& config, const Model& model, const std::string& pose_file);

}  // namespace lbea::tool
