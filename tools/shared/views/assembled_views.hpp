// The depth images of a component between the others of its test: frames show these, too.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

#include "tools/shared/matching/component_engine.hpp"

namespace lbea::tool {

/// Renders each sample of `model` with the samples of `others` of the same run and time step, as far as these are in
/// the part of space in which points count as the component's, and learns from these images what the bake learns from
/// its own. others: with the same runs, see difference_of_runs(), and in the same length unit. Throws Error{bad_config}
/// when the sensor does not see the component.
[[nodiscard]] SensorViews assembled_views(const Model& model, const std::vector<Model>& others,
                                          const bake::StereoSensor& sensor);

/// Gives components of one test these views, and the others those of views_for(). sensor_json: the text of the rig's
/// description; when it does not describe a whole rig, a warning is logged and all components have their own images.
/// Throws Error{bad_config | bad_input} as views_for() does.
void complete_views(std::vector<ComponentModel>& components, const MatcherConfig& config,
                    const std::string& sensor_json, const std::string& name);

}  // namespace lbea::tool
