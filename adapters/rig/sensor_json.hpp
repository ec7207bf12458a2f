// The stereo rig's calibration and noise, as sensor.json.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

namespace lbea::io {

struct SensorDescription {
  bake::StereoSensor sensor;
  bake::SensingNoise noise;
  std::string length_unit = "mm";
};

/// Reads all of it. Poses are three rows of four numbers (or four rows, the last 0 0 0 1). Required are
/// T_reference_sensor, sensor.T_reference_right, focal_px, width_px and height_px; what is not said of noise and
/// unit keeps its default.
/// Throws Error{file_not_found | bad_input} that names file and key: also for unknown keys, for a rotation that is
/// off by more than 1e-4, for shares outside 0..1, and, when `length_unit` is given, for another unit.
[[nodiscard]] SensorDescription read_sensor_json(const std::filesystem::path& path, std::string_view length_unit = {});

/// The same from the text of such a file; `name` stands for the file in errors.
[[nodiscard]] SensorDescription parse_sensor_json(std::string_view text, const std::filesystem::path& name,
                                                  std::string_view length_unit = {});

/// T_reference_sensor alone; nothing else needs to be in the file.
[[nodiscard]] RigidTransform read_pose(const std::filesystem::path& path, std::string_view length_unit = {});

}  // namespace lbea::io
