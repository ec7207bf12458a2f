// The Python module `lbea`: RigMatcher.
#include "tools/python/bindings.hpp"

#include <pybind11/stl.h>

#include <optional>

namespace py = pybind11;

namespace lbea::tool {
namespace {

struct PyRigMatcher {
  static constexpr const char* refusal = "another thread is using this RigMatcher; create one per test stand";
  PyRigMatcher(const Model& model, const MatcherConfig& config, const std::vector<Rig>& rigs)
      : matcher(model, config, rigs) {}
  RigMatcher matcher;
  std::atomic_flag busy;
};

template <class Number>
using PerRig = std::optional<std::vector<Number>>;

/// Raises ValueError if a list has another length than the rigs.
void require_one_per_rig(const char* name, std::size_t count, std::size_t rigs) {
  if (count != rigs)
    throw py::value_error(std::string(name) + " has " + std::to_string(count) + " elements; give one per rig, " +
                          std::to_string(rigs));
}

/// One number per rig; None: 0.
template <class Number>
std::vector<Number> per_rig(const char* name, const PerRig<Number>& numbers, std::size_t rigs) {
  if (numbers) require_one_per_rig(name, numbers->size(), rigs);
  return numbers ? *numbers : std::vector<Number>(rigs);
}

std::unique_ptr<PyRigMatcher> make_rig_matcher(const Model& model, const std::vector<py::object>& poses,
                                               const PerRig<std::int64_t>& clock_offsets_ns,
                                               const py::kwargs& settings) {
  const auto offsets_ns = per_rig("clock_offsets_ns", clock_offsets_ns, poses.size());
  std::vector<Rig> rigs;
  for (std::size_t rig = 0; rig < poses.size(); ++rig)
    rigs.push_back({transform_from(poses[rig]), {}, offsets_ns[rig]});
  return std::make_unique<PyRigMatcher>(model, config_from("RigMatcher", settings), rigs);
}

PyResult match_capture(PyRigMatcher& self, const std::vector<py::object>& points, const PerRig<std::uint64_t>& ids,
                       const PerRig<std::int64_t>& stamps_ns) {
  const std::size_t rigs = self.matcher.rigs().size();
  require_one_per_rig("points", points.size(), rigs);
  const auto id = per_rig("ids", ids, rigs);
  const auto stamp_ns = per_rig("stamps_ns", stamps_ns, rigs);
  std::vector<Frame> frames(rigs);
  for (std::size_t rig = 0; rig < rigs; ++rig)
    if (!points[rig].is_none()) frames[rig] = {id[rig], stamp_ns[rig], points_in(points[rig])};
  const Busy busy(self);
  MatchResult result;
  {
    const py::gil_scoped_release without_lock;
    result = self.matcher.match(frames);
  }
  PyResult copy = to_python(result, self.matcher.model());
  for (std::size_t rig = 0; rig < rigs; ++rig)
    copy.rigs.push_back({self.matcher.rigs()[rig], self.matcher.pose_correction(rig)});
  return copy;
}

void fix_poses(PyRigMatcher& self) {
  const Busy busy(self);
  self.matcher.fix_poses();
}

void set_impact_of_rigs(PyRigMatcher& self, std::int64_t stamp_ns) {
  const Busy busy(self);
  self.matcher.set_impact(stamp_ns);
}

void reset_rigs(PyRigMatcher& self) {
  const Busy busy(self);
  self.matcher.reset();
}

void bind_rig_result(py::module_& module) {
  py::class_<PyRigResult> type(module, "RigResult",
                               "What a rig's frame says alone; the numbers of the pose are by the frames of all rigs.");
  add_numbers(type, frame_numbers, [](const PyRigResult& r) -> const FrameNumbers& { return r; });
  add_numbers(type, fit_numbers, [](const PyRigResult& r) -> const FitNumbers& { return r; });
  type.def_property_readonly(
          "status", [](const PyRigResult& r) { return std::string(to_string(r.status)); },
          "empty_frame also if the rig has no frame in the capture")
      .def_property_readonly("verdict", [](const PyRigResult& r) { return std::string(to_string(r.verdict)); })
      .def_readonly("is_used", &PyRigResult::is_used, "whether the joint result rests on it")
      .def_property_readonly(
          "points", [](const PyRigResult& r) { return to_dict(r.points); }, "received = used + invalid + culled")
      .def_readonly("clock_correction_ns", &PyRigResult::clock_correction_ns,
                    "added to the rig's stamps beside its clock offset, it gives those of the first rig's clock, by "
                    "the impact\nthat both have seen; 0: not known, or within the interval between states")
      .def_property_readonly(
          "pose_correction", [](const PyRigResult& r) { return matrix(r.pose_correction); },
          "4 x 4: the motion that corrects its frames, in reference coordinates, after its pose");
}

}  // namespace

void bind_rigs(py::module_& module) {
  bind_rig_result(module);
  py::class_<PyRigMatcher>(module, "RigMatcher",
                           "One answer from several rigs that see the same component, by method fit. Create one per\n"
                           "test stand: it keeps what the frames of the test have shown, without a TestHistory.")
      .def(py::init(&make_rig_matcher), py::arg("model"), py::arg("poses"), py::arg("clock_offsets_ns") = py::none(),
           "poses: T_reference_sensor of each rig, 3 x 4 or 4 x 4; its depth images are those in the model for the\n"
           "nearest pose. clock_offsets_ns: added to the stamps of each rig's frames, they give those of a common\n"
           "clock. Further keyword settings as for Matcher. Raises lbea.Error.")
      .def("match", &match_capture, py::arg("points"), py::arg("ids") = py::none(), py::arg("stamps_ns") = py::none(),
           "points: for each rig n x 3 float32, as for Matcher.match, or None without a frame; captured at nearly the\n"
           "same time. ids, stamps_ns: one per rig. The result is for the time of the first frame that it rests on;\n"
           "its rigs tell what each frame says alone.")
      .def("fix_poses", &fix_poses, "The poses are exact: their errors are neither estimated nor corrected.")
      .def("set_impact", &set_impact_of_rigs, py::arg("stamp_ns"),
           "The impact's stamp, by the common clock, is known, also for later tests.")
      .def("reset", &reset_rigs, "Starts another test with the next capture.");
}

}  // namespace lbea::tool
