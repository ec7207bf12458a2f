// sensor.json for the frames: the rig's own file with what the command line changed.
#pragma once

#include "adapters/rig/sensor_json.hpp"

#include <filesystem>
#include <string>

namespace lbea::tool {

/// The text of `original` with the resolution and the noise of `used`; poses and whatever else stay as they are.
/// `original` must be a file that read_sensor_json() accepts.
[[nodiscard]] std::string sensor_copy(const std::filesystem::path& original, const io::SensorDescription& used);

}  // namespace lbea::tool
