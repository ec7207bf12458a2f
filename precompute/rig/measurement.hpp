// From what the cameras see to what the rig delivers: noise, dropouts, outliers, background.
#pragma once

#include "precompute/rig/view.hpp"

namespace lbea::bake::sensing {

/// See VirtualSensor::sense.
[[nodiscard]] std::vector<Point> measure(const Rig& rig, const View& view, const SensingNoise& noise,
                                         std::uint64_t seed);

}  // namespace lbea::bake::sensing
