// The demo's rig, on the opposite side of the rail.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>

namespace lbea::test {

/// The content of this sensor.json, turned by half a turn about the vertical through (200, 0, 0).
inline nlohmann::json opposite_rig(const std::filesystem::path& sensor) {
  nlohmann::json rig = nlohmann::json::parse(std::ifstream(sensor));
  for (nlohmann::json* rows : {&rig["T_reference_sensor"], &rig["sensor"]["T_reference_right"]})
    for (std::size_t row = 0; row < 2; ++row)
      for (std::size_t k = 0; k < 4; ++k) {
        double& value = (*rows)[row][k].get_ref<double&>();
        value = (row == 0 && k == 3 ? 400 : 0) - value;
      }
  return rig;
}

}  // namespace lbea::test
