// The depth images of a component between the others of its test: frames show these, too.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

#include <lbea/lbea.hpp>

#include <vector>

namespace lbea::tool {

/// Renders each sample of `model` with the samples of `others` of the same run and time step, as far as these are in
/// the part of space in which points count as the component's, and learns from these images what the bake learns from
/// its own. others: with the same runs, see difference_of_runs(), and in the same length unit. Throws Error{bad_config}
/// when the sensor does not see the component.
[[nodiscard]] SensorViews assembled_views(const Model& model, const std::vector<Model>& others,
                                          const bake::StereoSensor& sensor);

}  // namespace lbea::tool
