// The Python module `lbea`: TestHistory.
#include "tools/python/bindings.hpp"

namespace py = pybind11;

namespace lbea::tool {
namespace {

void fix_pose(PyTestHistory& self) {
  const Busy busy(self);
  self.history.fix_pose();
}

void set_impact(PyTestHistory& self, std::int64_t stamp_ns) {
  const Busy busy(self);
  self.history.set_impact(stamp_ns);
}

void reset(PyTestHistory& self) {
  const Busy busy(self);
  self.history.reset();
}

}  // namespace

void bind_history(py::module_& module) {
  py::class_<PyTestHistory>(module, "TestHistory",
                            "What the frames of a test have shown so far: pose error, shapes, clock. Create one per\n"
                            "test and give it to Matcher.match with each frame, in order, with stamps.")
      .def(py::init<const Model&>(), py::arg("model"))
      .def_property_readonly(
          "estimates_pose",
          [](PyTestHistory& self) {
            const Busy busy(self);
            return self.history.estimates_pose();
          },
          "whether the pose error is estimated: the model has depth images, the bake has learned how certain they\n"
          "are, and the pose is not fixed")
      .def_property_readonly(
          "pose_correction",
          [](PyTestHistory& self) {
            const Busy busy(self);
            return matrix(self.history.pose_correction());
          },
          "4 x 4: the motion that corrects the frames, in reference coordinates, after T_reference_sensor; a copy")
      .def("fix_pose", &fix_pose, "T_reference_sensor is exact: the pose error is neither estimated nor corrected.")
      .def("set_impact", &set_impact, py::arg("stamp_ns"),
           "The impact's stamp is known, also for later tests: it is not estimated.")
      .def("reset", &reset, "Starts another test with the next frame.");
}

}  // namespace lbea::tool
