// The Python module `lbea`: Matcher and its results.
#include "tools/python/bindings.hpp"

#include <pybind11/stl.h>

#include <optional>

namespace py = pybind11;

namespace lbea::tool {
namespace {

using Points = py::array_t<float, py::array::c_style>;

struct PyMatcher {
  static constexpr const char* refusal = "another thread is using this Matcher; create one per thread";
  PyMatcher(const Model& model, const MatcherConfig& config) : matcher(model, config) {}
  Matcher matcher;
  std::atomic_flag busy;
};

PyMatch match_of(const Match& match, const Model& model) {
  const std::uint32_t sample = model.sample_index(match.sample);
  return {match.sample.simulation,
          match.sample.time_step,
          sample,
          std::string(model.simulation_name(match.sample.simulation)),
          model.sample_time_s(sample),
          match.distance};
}

/// history: null to match the frame alone.
PyResult match(PyMatcher& self, const py::object& array, std::uint64_t id, std::int64_t stamp_ns,
               PyTestHistory* history) {
  const Frame frame{id, stamp_ns, points_in(array)};
  if (history != nullptr && history->model_checksum != self.matcher.model().checksum())
    throw py::value_error("history is of another model; create it with the matcher's model");
  const Busy busy(self);
  std::optional<Busy> history_busy;
  if (history != nullptr) history_busy.emplace(*history);
  MatchResult result;
  {
    const py::gil_scoped_release without_lock;
    result = history == nullptr ? self.matcher.match(frame) : self.matcher.match(frame, history->history);
  }
  return to_python(result, self.matcher.model());
}

Method method_named(const std::string& name) {
  if (name == "lbea") return Method::lbea;
  if (name == "vtp") return Method::vtp;
  if (name == "fit") return Method::fit;
  throw py::value_error("unknown method '" + name + "'; use lbea, vtp or fit");
}

std::unique_ptr<PyMatcher> make_matcher(const Model& model, const std::string& method,
                                        const py::object& T_reference_sensor, const py::kwargs& settings) {
  MatcherConfig config = config_from("Matcher", settings);
  config.method = method_named(method);
  config.T_reference_sensor = transform_from(T_reference_sensor);
  return std::make_unique<PyMatcher>(model, config);
}

py::dict stages_of(const StageTimes& times) {
  using namespace py::literals;
  return py::dict("index"_a = times.index, "correspondence"_a = times.correspondence, "projection"_a = times.projection,
                  "matching"_a = times.matching, "coverage"_a = times.coverage, "fit"_a = times.fit);
}

py::array coefficients_of(const py::object& self) {
  auto& result = self.cast<PyResult&>();
  return py::array_t<float>(std::vector<py::ssize_t>{static_cast<py::ssize_t>(result.coefficients.size() / 3), 3},
                            result.coefficients.data(), self);
}

void bind_match(py::module_& module) {
  py::class_<PyMatch>(module, "Match", "A sample of the ensemble and its distance from the frame.")
      .def_readonly("simulation", &PyMatch::simulation)
      .def_readonly("simulation_name", &PyMatch::simulation_name)
      .def_readonly("time_step", &PyMatch::time_step)
      .def_readonly("time_s", &PyMatch::time_s)
      .def_readonly("sample", &PyMatch::sample, "its index, for Model.node_positions and Model.field_values")
      .def_readonly("distance", &PyMatch::distance,
                    "LBEA: eq. 3; VtP: mean per vertex; fit: estimated EE; candidates: residual")
      .def("__repr__", [](const PyMatch& m) {
        return "<lbea.Match: " + m.simulation_name + " step " + std::to_string(m.time_step) + ", distance " +
               std::to_string(m.distance) + ">";
      });
  py::class_<PyShare>(module, "Share", "The weight of a sample in the estimate; all weights sum to 1.")
      .def_readonly("sample", &PyShare::sample)
      .def_readonly("weight", &PyShare::weight);
  py::class_<PyChannel>(module, "Channel", "A quantity of interest in a frame.")
      .def_readonly("name", &PyChannel::name)
      .def_readonly("unit", &PyChannel::unit)
      .def_readonly("value", &PyChannel::value)
      .def_readonly("bound_90", &PyChannel::bound_90, "90 % of the true values differ by less; NaN: not known");
}

void bind_result(py::module_& module) {
  py::class_<PyResult> type(module, "Result", "The result of one frame.");
  add_numbers(type, frame_numbers, [](const PyResult& r) { return r.frame_numbers; });
  add_numbers(type, fit_numbers, [](const PyResult& r) { return r.fit_numbers; });
  type.def_readonly("status", &PyResult::status)
      .def_readonly("verdict", &PyResult::verdict)
      .def_readonly("frame_id", &PyResult::frame_id)
      .def_readonly("stamp_ns", &PyResult::stamp_ns)
      .def_readonly("reference", &PyResult::reference)
      .def_readonly("matches", &PyResult::matches, "nearest first")
      .def_readonly("candidates", &PyResult::candidates, "fit: the samples most similar to the frame")
      .def_readonly("estimate", &PyResult::estimate, "fit: the weighted mean of samples that fits the frame best")
      .def_readonly("channels", &PyResult::channels, "quantities of interest, in the order of Model.channels")
      .def_readonly("rigs", &PyResult::rigs, "of RigMatcher: what each rig's frame says alone, a RigResult each")
      .def_readonly("leading_coordinates", &PyResult::leading_coordinates)
      .def_property_readonly("coefficients", &coefficients_of,
                             "modes x 3: coefficients of the frame, or of the estimate by fit, in the basis")
      .def_property_readonly(
          "points", [](const PyResult& r) { return to_dict(r.points); }, "received = used + invalid + culled")
      .def_property_readonly(
          "elapsed_ns", [](const PyResult& r) { return stages_of(r.elapsed_ns); }, "wall time of each stage in ns")
      .def("__repr__", [](const PyResult& r) {
        return "<lbea.Result: frame " + std::to_string(r.frame_id) + ", " + r.status + ", " +
               std::to_string(r.matches.size()) + " matches>";
      });
}

}  // namespace

PyResult to_python(const MatchResult& result, const Model& model) {
  PyResult copy{.status = std::string(to_string(result.status)),
                .verdict = std::string(to_string(result.verdict)),
                .frame_id = result.frame_id,
                .stamp_ns = result.stamp_ns,
                .reference = result.reference,
                .frame_numbers = result,
                .fit_numbers = result.fit,
                .points = result.points,
                .coefficients = {result.coefficients.begin(), result.coefficients.end()},
                .leading_coordinates = result.leading_coordinates,
                .elapsed_ns = result.elapsed_ns,
                .is_ok = result.status == Status::ok,
                .verdict_value = result.verdict,
                .model_checksum = model.checksum()};
  for (const Match& match : result.matches) copy.matches.push_back(match_of(match, model));
  for (const Match& candidate : result.fit.candidates) copy.candidates.push_back(match_of(candidate, model));
  for (const WeightedSample& share : result.fit.estimate)
    copy.estimate.push_back({model.sample_index(share.sample), share.weight});
  for (std::uint32_t c = 0; c < result.channels.size(); ++c)
    copy.channels.push_back(
        {result.channels[c], std::string(model.channel(c).name), std::string(model.channel(c).unit)});
  return copy;
}

std::span<const Point> points_in(const py::object& points) {
  if (py::hasattr(points, "mask"))
    throw py::type_error("points (a masked array): the mask would be ignored; give the valid rows, as an array");
  if (!py::isinstance<Points>(points)) {
    const bool is_array = py::isinstance<py::array>(points);
    const py::object found = is_array ? points.attr("dtype") : py::type::of(points).attr("__name__");
    throw py::type_error("points (" + py::str(found).cast<std::string>() +
                         "): needs float32, n x 3, contiguous; numpy.asarray(points, numpy.float32, order=\"C\")");
  }
  const auto array = py::reinterpret_borrow<Points>(points);
  if (array.ndim() != 2 || array.shape(1) != 3) throw py::value_error("points must be an n x 3 array");
  static_assert(sizeof(Point) == 3 * sizeof(float));
  if (reinterpret_cast<std::uintptr_t>(array.data()) % alignof(Point) != 0)
    throw py::value_error("points are not aligned to 4 bytes; copy them with numpy.array(points)");
  return {reinterpret_cast<const Point*>(array.data()), static_cast<std::size_t>(array.shape(0))};
}

RigidTransform transform_from(const py::object& given) {
  if (given.is_none()) return identity_transform;
  const py::array_t<double, py::array::c_style | py::array::forcecast> matrix(given);
  if (matrix.ndim() != 2 || (matrix.shape(0) != 3 && matrix.shape(0) != 4) || matrix.shape(1) != 4)
    throw py::value_error("T_reference_sensor must be 3 x 4 or 4 x 4");
  constexpr std::array last_row{0.0, 0.0, 0.0, 1.0};
  const auto is_near = [](double a, double b) { return std::abs(a - b) <= 1e-6; };
  if (matrix.shape(0) == 4 &&
      !std::equal(last_row.begin(), last_row.end(), matrix.data() + std::tuple_size_v<RigidTransform>, is_near))
    throw py::value_error("the last row of T_reference_sensor must be 0 0 0 1; transpose a column-major matrix");
  RigidTransform T;
  for (std::size_t i = 0; i < T.size(); ++i) T[i] = static_cast<float>(matrix.data()[i]);
  return T;
}

MatcherConfig config_from(const std::string& class_name, const py::kwargs& settings) {
  MatcherConfig config;
  for (const auto& [key, value] : settings) {
    const auto name = key.cast<std::string>();
    if (name == "max_points")
      config.max_points = value.cast<std::uint32_t>();
    else if (name == "max_matches")
      config.max_matches = value.cast<std::uint32_t>();
    else if (name == "trusted_distance")
      config.trusted_distance = value.cast<float>();
    else if (name == "min_coverage")
      config.min_coverage = value.cast<float>();
    else if (name == "trigger_ns")
      config.trigger_ns = value.cast<std::int64_t>();
    else
      throw py::type_error(class_name + " has no setting '" + name + "'");
  }
  return config;
}

py::dict to_dict(const PointTally& points) {
  using namespace py::literals;
  return py::dict("received"_a = points.received, "invalid"_a = points.invalid, "culled"_a = points.culled,
                  "used"_a = points.used);
}

void bind_matcher(py::module_& module) {
  bind_match(module);
  bind_result(module);
  py::class_<PyMatcher>(module, "Matcher", "Matches frames. Create one per thread: it owns all scratch memory.")
      .def(py::init(&make_matcher), py::arg("model"), py::arg("method") = "lbea",
           py::arg("T_reference_sensor") = py::none(),
           "method: lbea, vtp or fit. T_reference_sensor: 3 x 4 or 4 x 4, default identity. Further keyword settings:\n"
           "max_points, max_matches, trusted_distance, min_coverage, trigger_ns. Raises lbea.Error.")
      .def("match", &match, py::arg("points"), py::arg("id") = 0, py::arg("stamp_ns") = 0,
           py::arg("history") = py::none(),
           "points: n x 3 float32, C order, sensor coordinates. They are read in place and without the interpreter "
           "lock;\n"
           "do not modify them during the call. Other arrays are refused, not copied; convert them with\n"
           "numpy.asarray(points, numpy.float32, order='C').\n"
           "history: the TestHistory of the frame's test, to which the frame adds; method fit only. While the pose\n"
           "error is not known yet, a frame is matched up to eight times. Another model's raises ValueError.");
}

}  // namespace lbea::tool
