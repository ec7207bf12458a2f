// The Python module `lbea`: Forecast.
#include "tools/python/bindings.hpp"

#include <lbea/forecast.hpp>

#include <pybind11/stl.h>

namespace py = pybind11;

namespace lbea::tool {
namespace {

struct PyForecast {
  static constexpr const char* refusal = "another thread is using this Forecast; create one per test";
  explicit PyForecast(const Model& of) : model(of), forecast(of) {}
  Model model;
  Forecast forecast;
  std::atomic_flag busy;
};

void update(PyForecast& self, const PyResult& result) {
  if (result.model_checksum != self.model.checksum())
    throw py::value_error("the result is of another model; create Forecast with the matcher's model");
  const Busy busy(self);
  std::vector<WeightedSample> estimate;
  for (const PyShare& share : result.estimate) estimate.push_back({self.model.sample(share.sample), share.weight});
  MatchResult given;
  given.status = result.is_ok ? Status::ok : Status::low_coverage;
  given.verdict = result.verdict_value;
  static_cast<FitNumbers&>(given.fit) = result.fit_numbers;
  given.fit.estimate = estimate;
  self.forecast.update(given);
}

py::dict parameter_forecasts(const PyForecast& self) {
  py::dict found;
  for (std::uint32_t p = 0; p < self.model.parameters(); ++p)
    found[py::str(std::string(self.model.parameter_name(p)))] = self.forecast.state().parameters[p];
  return found;
}

py::dict channel_forecasts(const PyForecast& self) {
  py::dict found;
  const auto channels = self.forecast.state().channels;
  for (std::uint32_t c = 0; c < channels.size(); ++c)
    found[py::str(std::string(self.model.channel(c).name))] = channels[c];
  return found;
}

py::array forecast_positions(const PyForecast& self) {
  const std::vector<float> positions = final_positions(self.model, self.forecast.state());
  return py::array_t<float>(std::vector<py::ssize_t>{static_cast<py::ssize_t>(self.model.nodes()), 3},
                            positions.data());
}

/// A property that reads the state.
template <class Read>
void add_property(py::class_<PyForecast>& type, const char* name, const char* meaning, Read read) {
  type.def_property_readonly(
      name,
      [read](PyForecast& self) {
        const Busy busy(self);
        return read(self);
      },
      meaning);
}

void bind_parameter(py::module_& module) {
  py::class_<ParameterForecast>(module, "ParameterForecast", "What the frames so far tell about a parameter.")
      .def_readonly("value", &ParameterForecast::value, "near the runs' mean if it is not identifiable")
      .def_readonly("bound_90", &ParameterForecast::bound_90,
                    "90 % of the runs that are not in the ensemble differ by less")
      .def_readonly("r2", &ParameterForecast::r2,
                    "share of the variance over left-out runs that the frames explain, less its standard error")
      .def_property_readonly("is_identifiable", &ParameterForecast::is_identifiable,
                             "whether the shape tells the parameter");
}

void bind_channel(py::module_& module) {
  py::class_<ChannelForecast>(
      module, "ChannelForecast",
      "A quantity of interest by all frames so far. They also show how fast the shape changes,\n"
      "which a single frame does not: use it for velocities and accelerations.")
      .def_readonly("value", &ChannelForecast::value,
                    "at test_time_s; NaN before the first frame with evidence, and after the simulations' end")
      .def_readonly("bound_90", &ChannelForecast::bound_90,
                    "90 % of the runs that are not in the ensemble differ by less")
      .def_readonly("final_value", &ChannelForecast::final_value, "at the end of the simulations")
      .def_readonly("final_bound_90", &ChannelForecast::final_bound_90, "the same bound of it");
}

void bind_state(py::class_<PyForecast>& type) {
  const auto state = [](const PyForecast& self) -> const TestForecast& { return self.forecast.state(); };
  add_property(type, "frames", "number of frames with evidence; without any, the forecast is what all runs share",
               [state](const PyForecast& self) { return state(self).frames; });
  add_property(type, "test_time_s", "of the latest frame with evidence",
               [state](const PyForecast& self) { return state(self).test_time_s; });
  add_property(type, "error_90", "the final shape's mean distance from the truth is below this in 90 % of such tests",
               [state](const PyForecast& self) { return state(self).error_90; });
  add_property(type, "run_weights", "one per simulation: the final shape is this combination of the runs' last samples",
               [state](const PyForecast& self) {
                 const auto weights = state(self).run_weights;
                 return py::array_t<float>(static_cast<py::ssize_t>(weights.size()), weights.data());
               });
  add_property(type, "branch_probabilities", "one per branch", [state](const PyForecast& self) {
    const auto branches = state(self).branch_probabilities;
    return std::vector<float>(branches.begin(), branches.end());
  });
  add_property(type, "parameters", "dict of ParameterForecast by name; copies", &parameter_forecasts);
  add_property(type, "channels",
               "dict of ChannelForecast by name, empty for models baked before they were learned; copies",
               &channel_forecasts);
}

}  // namespace

void bind_forecast(py::module_& module) {
  bind_parameter(module);
  bind_channel(module);
  py::class_<PyForecast> type(module, "Forecast",
                              "How a test will end, by its frames so far. Create one per test and give it each result\n"
                              "of Matcher.match by method fit with a TestHistory.");
  type.def(py::init<const Model&>(), py::arg("model"), "Raises lbea.Error for a model without a forecast.")
      .def_static("is_in", &Forecast::is_in, py::arg("model"), "whether the bake has learned forecasts")
      .def("update", &update, py::arg("result"), "Adds a frame. Another model's result raises ValueError.")
      .def(
          "final_positions",
          [](PyForecast& self) {
            const Busy busy(self);
            return forecast_positions(self);
          },
          "nodes x 3: the forecast's final shape")
      .def(
          "reset",
          [](PyForecast& self) {
            const Busy busy(self);
            self.forecast.reset();
          },
          "Starts another test with the next frame.");
  bind_state(type);
}

}  // namespace lbea::tool
