#include "tools/sense/sensor_copy.hpp"

#include "adapters/files/atomic_file.hpp"

#include <array>
#include <charconv>
#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {
/// The double with the float's own digits: 0.1, not 0.10000000149.
double as_written(float value) {
  std::array<char, 40> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}
}  // namespace

std::string sensor_copy(const std::filesystem::path& original, const io::SensorDescription& used) {
  const auto bytes = io::read_file(original);
  auto json = nlohmann::ordered_json::parse(io::as_text(bytes));
  auto& camera = json["sensor"];
  camera["focal_px"] = as_written(used.sensor.focal_px);
  camera["width_px"] = used.sensor.width_px;
  camera["height_px"] = used.sensor.height_px;
  json.erase("noise_mm");  // "noise" is in the file's own length unit, as SensingNoise is
  json["noise"] = as_written(used.noise.sigma);
  json["outliers"] = as_written(used.noise.outliers);
  json["min_cos_incidence"] = as_written(used.noise.min_cos_incidence);
  json["dropout"] = as_written(used.noise.dropout);
  json["background"] = as_written(used.noise.background);
  return json.dump(1) + '\n';
}

}  // namespace lbea::tool
