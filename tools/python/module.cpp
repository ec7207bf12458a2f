// The Python module `lbea`: numpy arrays in, plain objects and views of the model out. Here: Model, Error, sensor.json.
#include "adapters/rig/sensor_json.hpp"
#include "tools/python/bindings.hpp"

#include <pybind11/stl/filesystem.h>

#include <exception>

namespace py = pybind11;

namespace lbea::tool {

py::array matrix(const RigidTransform& T) {
  constexpr std::array<double, 4> last_row{0, 0, 0, 1};
  py::array_t<double> rows({4, 4});
  std::ranges::copy(last_row, std::ranges::copy(T, rows.mutable_data()).out);
  return rows;
}

namespace {

using Shape = std::vector<py::ssize_t>;

/// The memory of the model as a read-only array that keeps the model alive.
template <typename T>
py::array view_of(const py::object& model, std::span<const T> values, Shape shape) {
  py::array_t<T> array(std::move(shape), values.data(), model);
  array.attr("flags").attr("writeable") = false;
  return array;
}

py::ssize_t size_of(std::uint32_t count) { return static_cast<py::ssize_t>(count); }

const Model& model_of(const py::object& self) { return self.cast<const Model&>(); }

std::uint32_t checked(std::uint32_t index, std::uint32_t count, const char* what) {
  if (index >= count)
    throw py::index_error(std::string(what) + " " + std::to_string(index) + " is out of range: the model has " +
                          std::to_string(count));
  return index;
}

std::uint32_t field_named(const Model& model, const std::string& name) {
  for (std::uint32_t f = 0; f < model.fields(); ++f)
    if (model.field(f).name == name) return f;
  throw py::key_error("the model has no field '" + name + "'");
}

py::list names(std::uint32_t count, auto&& name_of) {
  py::list list;
  for (std::uint32_t i = 0; i < count; ++i) list.append(py::str(std::string(name_of(i))));
  return list;
}

py::array samples_of(const Model& model) {
  py::array_t<std::uint32_t> rows(Shape{size_of(model.samples()), 2});
  auto row = rows.mutable_unchecked<2>();
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    row(s, 0) = model.sample(s).simulation;
    row(s, 1) = model.sample(s).time_step;
  }
  return rows;
}

py::array times_of(const Model& model) {
  py::array_t<double> times(size_of(model.samples()));
  for (std::uint32_t s = 0; s < model.samples(); ++s) times.mutable_at(s) = model.sample_time_s(s);
  return times;
}

py::dict parameters_of(const Model& model, std::uint32_t simulation) {
  checked(simulation, model.simulations(), "simulation");
  py::dict values;
  for (std::uint32_t p = 0; p < model.parameters(); ++p)
    values[py::str(std::string(model.parameter_name(p)))] = model.parameter(simulation, p);
  return values;
}

py::array field_values_of(const py::object& self, const std::string& name, std::uint32_t sample) {
  const Model& model = model_of(self);
  const std::uint32_t field = field_named(model, name), row = checked(sample, model.samples(), "sample");
  const auto values = model.field_values(field, row);
  if (!values.empty()) return view_of(self, values, {size_of(model.field_size(field))});
  py::array_t<float> read(size_of(model.field_size(field)));
  model.read_field(field, row, {read.mutable_data(), model.field_size(field)});
  return read;
}

py::array node_positions_of(const py::object& self, std::uint32_t sample) {
  const Model& m = model_of(self);
  return view_of(self, m.node_positions(checked(sample, m.samples(), "sample")), {size_of(m.nodes()), 3});
}

py::array vertex_positions_of(const py::object& self, std::uint32_t reference) {
  const Model& m = model_of(self);
  return view_of(self, m.vertex_positions(checked(reference, m.references(), "reference")), {size_of(m.vertices()), 3});
}

py::array eigenvalues_of(const py::object& self, std::uint32_t reference) {
  const Model& m = model_of(self);
  return view_of(self, m.eigenvalues(checked(reference, m.references(), "reference")), {size_of(m.modes())});
}

py::array element_nodes_of(const py::object& self) {
  return view_of(self, model_of(self).element_nodes(), {size_of(model_of(self).elements()), 4});
}

/// A view of one of the model's lists of numbers.
template <auto list>
py::array list_of(const py::object& self) {
  const auto values = (model_of(self).*list)();
  return view_of(self, values, {static_cast<py::ssize_t>(values.size())});
}

float field_error_of(const Model& model, const std::string& name) {
  return model.field(field_named(model, name)).largest_error;
}

void bind_ensemble(py::class_<Model>& type) {
  type.def_property_readonly(
          "simulations",
          [](const Model& m) { return names(m.simulations(), [&](auto i) { return m.simulation_name(i); }); },
          "names of the simulations, in the order of their indices")
      .def_property_readonly(
          "fields", [](const Model& m) { return names(m.fields(), [&](auto i) { return m.field(i).name; }); },
          "names of the baked fields, e.g. plastic strain")
      .def_property_readonly(
          "channels", [](const Model& m) { return names(m.channels(), [&](auto i) { return m.channel(i).name; }); },
          "names of the quantities of interest")
      .def_property_readonly("samples", &samples_of, "s x 2: simulation and time step of each sample")
      .def_property_readonly("sample_times_s", &times_of, "s: time of each sample")
      .def("parameters", &parameters_of, py::arg("simulation"),
           "parameters of a simulation: a dict of floats, NaN where the value is unknown");
}

void bind_arrays(py::class_<Model>& type) {
  type.def("node_positions", &node_positions_of, py::arg("sample"),
           "nodes x 3: the whole deformed mesh of a sample, including what no camera sees")
      .def("field_values", &field_values_of, py::arg("field"), py::arg("sample"),
           "one value per element or per node: a view of the model, or a copy where the model stores 16 bits")
      .def("field_error", &field_error_of, py::arg("field"),
           "largest rounding error of the field's values: 0, or half of a 16-bit step")
      .def("vertex_positions", &vertex_positions_of, py::arg("reference") = 0,
           "vertices x 3: the observed region of the reference mesh")
      .def("eigenvalues", &eigenvalues_of, py::arg("reference") = 0, "one per mode, ascending, 1 / length^2")
      .def_property_readonly("element_nodes", &element_nodes_of,
                             "elements x 4 node indices; a triangle repeats its last node")
      .def_property_readonly("node_ids", &list_of<&Model::node_ids>, "node numbers of the solver")
      .def_property_readonly("element_ids", &list_of<&Model::element_ids>, "element numbers of the solver")
      .def_property_readonly("element_parts", &list_of<&Model::element_parts>, "part number of each element");
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

void bind_sensor(py::module_& module) {
  module.def(
      "read_pose", [](const std::filesystem::path& file) { return matrix(io::read_pose(file)); }, py::arg("file"),
      "4 x 4: T_reference_sensor of a sensor.json, for Matcher. Raises lbea.Error.");
  module.def("read_sensor", &read_sensor, py::arg("file"),
             "The poses and the camera of a sensor.json, as a dict. Raises lbea.Error.");
}

/// Raises lbea.Error with the attribute `status`, a name such as "corrupt_model".
void raise(const py::object& type, const Error& error) {
  const py::object instance = type(error.what());
  instance.attr("status") = to_string(error.status);
  PyErr_SetObject(type.ptr(), instance.ptr());
}

void bind_model(py::module_& module) {
  py::class_<Model> type(module, "Model", "A baked model file, mapped read-only. Threads may share it.");
  type.def(py::init([](const std::filesystem::path& file) {
             const py::gil_scoped_release without_lock;
             return Model::open(file);
           }),
           py::arg("file"), "Maps and checks the file. Raises lbea.Error, whose status and text describe the problem.")
      .def_property_readonly("vertices", &Model::vertices, "number of vertices of the observed region")
      .def_property_readonly("modes", &Model::modes, "number of modes")
      .def_property_readonly("nodes", &Model::nodes, "number of nodes of the whole component")
      .def_property_readonly("elements", &Model::elements, "number of elements of the whole component")
      .def_property_readonly("references", &Model::references,
                             "number of reference meshes: 1 at impact, one per time step over time")
      .def_property_readonly("length_unit", &Model::length_unit)
      .def_property_readonly("checksum", &Model::checksum, "identifies the model")
      .def_property_readonly("provenance", &Model::provenance, "JSON: tool version, input files and their hashes")
      .def("__repr__", [](const Model& m) {
        return "<lbea.Model: " + std::to_string(m.samples()) + " samples of " + std::to_string(m.simulations()) +
               " simulations, " + std::to_string(m.vertices()) + " vertices, " + std::to_string(m.modes()) + " modes>";
      });
  bind_ensemble(type);
  bind_arrays(type);
}

}  // namespace
}  // namespace lbea::tool

PYBIND11_MODULE(lbea, module) {
  module.doc() =
      "Finds the simulation of an ensemble, and its time step, that a point cloud matches.\n\n"
      "    model = lbea.Model('rail.lbea')\n"
      "    matcher = lbea.Matcher(model, max_matches=3)\n"
      "    result = matcher.match(points)            # n x 3 float32, sensor coordinates\n"
      "    print(result.status, result.matches[0])\n\n"
      "Arrays of a model are read-only views of the mapped file.";
  module.attr("__version__") = LBEA_VERSION_STRING;
  static py::handle error_type = py::exception<lbea::Error>(module, "Error", PyExc_RuntimeError).release();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const lbea::Error& error) { lbea::tool::raise(py::reinterpret_borrow<py::object>(error_type), error); }
  });
  lbea::tool::bind_model(module);
  lbea::tool::bind_history(module);
  lbea::tool::bind_rigs(module);
  lbea::tool::bind_matcher(module);
  lbea::tool::bind_forecast(module);
  lbea::tool::bind_sensor(module);
}
