// The Python module `lbea`: TestPose.
#include "tools/python/bindings.hpp"

namespace py = pybind11;

namespace lbea::tool {

void bind_pose(py::module_& module) {
  py::class_<PyTestPose>(module, "TestPose",
                         "The pose error of a test, estimated from its frames. Create one per test and give it to\n"
                         "Matcher.match with each frame, in order.")
      .def(py::init<const Model&>(), py::arg("model"))
      .def_property_readonly(
          "is_estimated", [](const PyTestPose& self) { return self.pose.is_estimated(); },
          "whether the model supports the estimate: it has depth images, and the bake has learned how certain they\n"
          "are; else frames are matched as without a pose")
      .def_property_readonly(
          "correction",
          [](PyTestPose& self) {
            const Busy busy(self);
            return matrix(self.pose.correction());
          },
          "4 x 4: the motion that corrects the frames, in reference coordinates, after T_reference_sensor; a copy")
      .def(
          "reset",
          [](PyTestPose& self) {
            const Busy busy(self);
            self.pose.reset();
          },
          "Starts another test with the next frame.");
}

}  // namespace lbea::tool
