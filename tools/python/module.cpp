#include "tools/python/bindings.hpp"

#include <exception>

namespace py = pybind11;

namespace {

// lbea.Error with the attribute `status`, a name such as "corrupt_model".
void raise(const py::object& type, const lbea::Error& error) {
  const py::object instance = type(error.what());
  instance.attr("status") = lbea::to_string(error.status);
  PyErr_SetObject(type.ptr(), instance.ptr());
}

}  // namespace

PYBIND11_MODULE(lbea, module) {
  module.doc() =
      "Tells which simulation of an ensemble, and which time step of it, looks like a point cloud.\n\n"
      "    model = lbea.Model('rail.lbea')\n"
      "    matcher = lbea.Matcher(model, max_matches=3)\n"
      "    result = matcher.match(points)            # n x 3 float32, sensor coordinates\n"
      "    print(result.status, result.matches[0])\n\n"
      "Arrays of a model are views of the mapped file: nothing is copied, nothing can be written.";
  module.attr("__version__") = LBEA_VERSION_STRING;
  static py::handle error_type = py::exception<lbea::Error>(module, "Error", PyExc_RuntimeError).release();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const lbea::Error& error) { raise(py::reinterpret_borrow<py::object>(error_type), error); }
  });
  lbea::tool::bind_model(module);
  lbea::tool::bind_matcher(module);
}
