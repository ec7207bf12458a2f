#include "tools/python/bindings.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl/filesystem.h>

#include <string>
#include <vector>

namespace py = pybind11;

namespace lbea::tool {
namespace {

using Shape = std::vector<py::ssize_t>;

/// The model's own memory as an array that cannot be written and keeps the model alive.
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
    throw py::index_error(std::string("there is no ") + what + " " + std::to_string(index) + " of " +
                          std::to_string(count));
  return index;
}

std::uint32_t field_named(const Model& model, const std::string& name) {
  for (std::uint32_t f = 0; f < model.fields(); ++f)
    if (model.field(f).name == name) return f;
  throw py::key_error("the model carries no field '" + name + "'");
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

void bind_ensemble(py::class_<Model>& type) {
  type.def_property_readonly(
          "simulations",
          [](const Model& m) { return names(m.simulations(), [&](auto i) { return m.simulation_name(i); }); },
          "names, in the order of their indices")
      .def_property_readonly(
          "fields", [](const Model& m) { return names(m.fields(), [&](auto i) { return m.field(i).name; }); },
          "names of the quantities carried along, e.g. plastic strain")
      .def_property_readonly("samples", &samples_of, "s x 2: simulation and time step of every sample")
      .def_property_readonly("sample_times_s", &times_of, "s")
      .def("parameters", &parameters_of, py::arg("simulation"),
           "what the run was made with: a dict of floats, NaN where not given");
}

void bind_arrays(py::class_<Model>& type) {
  type.def(
          "node_positions",
          [](const py::object& self, std::uint32_t sample) {
            const Model& m = model_of(self);
            return view_of(self, m.node_positions(checked(sample, m.samples(), "sample")), {size_of(m.nodes()), 3});
          },
          py::arg("sample"), "nodes x 3: the sample's whole deformed mesh, also what no camera sees")
      .def("field_values", &field_values_of, py::arg("field"), py::arg("sample"),
           "one value per element, or per node: the model's own memory, or a copy where it is stored in 16 bits")
      .def(
          "field_error",
          [](const Model& m, const std::string& name) { return m.field(field_named(m, name)).largest_error; },
          py::arg("field"), "how far any of its values may be off: 0, or half of a 16-bit step")
      .def(
          "vertex_positions",
          [](const py::object& self, std::uint32_t reference) {
            const Model& m = model_of(self);
            return view_of(self, m.vertex_positions(checked(reference, m.references(), "reference")),
                           {size_of(m.vertices()), 3});
          },
          py::arg("reference") = 0, "vertices x 3: the observed region of the reference mesh")
      .def(
          "eigenvalues",
          [](const py::object& self, std::uint32_t reference) {
            const Model& m = model_of(self);
            return view_of(self, m.eigenvalues(checked(reference, m.references(), "reference")), {size_of(m.modes())});
          },
          py::arg("reference") = 0, "modes, ascending, 1 / length^2")
      .def_property_readonly(
          "element_nodes",
          [](const py::object& self) {
            const Model& m = model_of(self);
            return view_of(self, m.element_nodes(), {size_of(m.elements()), 4});
          },
          "elements x 4 node indices; a triangle repeats its last node")
      .def_property_readonly(
          "node_ids",
          [](const py::object& self) {
            return view_of(self, model_of(self).node_ids(), {size_of(model_of(self).nodes())});
          },
          "the solver's numbering");
}

}  // namespace

void bind_model(py::module_& module) {
  py::class_<Model> type(module, "Model", "A baked file, mapped read-only. Share it freely between threads.");
  type.def(py::init([](const std::filesystem::path& file) {
             const py::gil_scoped_release others_may_run;
             return Model::open(file);
           }),
           py::arg("file"),
           "Maps and checks the file; raises lbea.Error, whose status and sentence say what is wrong with it.")
      .def_property_readonly("vertices", &Model::vertices, "n, of the observed region")
      .def_property_readonly("modes", &Model::modes, "p")
      .def_property_readonly("nodes", &Model::nodes, "of the whole component")
      .def_property_readonly("elements", &Model::elements)
      .def_property_readonly("references", &Model::references, "reference meshes: 1 at impact, time steps over time")
      .def_property_readonly("length_unit", &Model::length_unit)
      .def_property_readonly("checksum", &Model::checksum, "names this model")
      .def_property_readonly("provenance", &Model::provenance, "JSON: tool version, inputs and their hashes")
      .def("__repr__", [](const Model& m) {
        return "<lbea.Model: " + std::to_string(m.samples()) + " samples of " + std::to_string(m.simulations()) +
               " simulations, " + std::to_string(m.vertices()) + " vertices, " + std::to_string(m.modes()) + " modes>";
      });
  bind_ensemble(type);
  bind_arrays(type);
}

}  // namespace lbea::tool
