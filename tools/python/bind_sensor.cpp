// The Python module `lbea`: sensor.json.
#include "adapters/rig/sensor_json.hpp"
#include "tools/python/bindings.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

namespace py = pybind11;

namespace lbea::tool {
namespace {

py::array matrix(const RigidTransform& T) {
  constexpr std::array<double, 4> last_row{0, 0, 0, 1};
  py::array_t<double> rows({4, 4});
  std::ranges::copy(last_row, std::ranges::copy(T, rows.mutable_data()).out);
  return rows;
}

py::dict read_sensor(const std::filesystem::path& file) {
  using namespace py::literals;
  const io::SensorDescription description = io::read_sensor_json(file);
  const bake::StereoSensor& sensor = description.sensor;
  return py::dict("T_reference_sensor"_a = matrix(sensor.T_reference_sensor),
                  "T_reference_right"_a = matrix(sensor.T_reference_right), "focal_px"_a = sensor.focal_px,
                  "width_px"_a = sensor.width_px, "height_px"_a = sensor.height_px,
                  "length_unit"_a = description.length_unit);
}

}  // namespace

void bind_sensor(py::module_& module) {
  module.def(
      "read_pose", [](const std::filesystem::path& file) { return matrix(io::read_pose(file)); }, py::arg("file"),
      "4 x 4: T_reference_sensor of a sensor.json, for Matcher. Raises lbea.Error.");
  module.def("read_sensor", &read_sensor, py::arg("file"),
             "The poses and the camera of a sensor.json, as a dict. Raises lbea.Error.");
}

}  // namespace lbea::tool
