// Parts of the Python module `lbea`.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/rigs.hpp>
#include <lbea/test_history.hpp>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <atomic>
#include <string>
#include <vector>

namespace lbea::tool {

/// Marks an object as busy while it is used without the interpreter lock.
class Busy {
 public:
  template <class Object>
  explicit Busy(Object& object) : flag_(object.busy) {
    if (flag_.test_and_set()) throw std::runtime_error(Object::refusal);
  }
  ~Busy() { flag_.clear(); }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

 private:
  std::atomic_flag& flag_;
};

struct PyTestHistory {
  static constexpr const char* refusal = "another thread is using this TestHistory; create one per test";
  explicit PyTestHistory(const Model& model) : history(model), model_checksum(model.checksum()) {}
  TestHistory history;
  std::uint64_t model_checksum;
  std::atomic_flag busy;
};

struct PyMatch {
  std::uint32_t simulation = 0, time_step = 0, sample = 0;
  std::string simulation_name;
  double time_s = 0;
  float distance = 0;
};

struct PyShare {
  std::uint32_t sample = 0;
  float weight = 0;
};

struct PyChannel : ChannelValue {
  std::string name, unit;
};

struct PyRigResult : RigResult {
  RigidTransform pose_correction = identity_transform;
};

/// A copy of a MatchResult, which is valid only until the next match.
struct PyResult {
  std::string status, verdict;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t reference = 0;
  FrameNumbers frame_numbers;
  FitNumbers fit_numbers;
  PointTally points;
  std::vector<float> coefficients;
  std::array<float, 3> leading_coordinates{};
  std::vector<PyMatch> matches{}, candidates{};
  std::vector<PyShare> estimate{};
  std::vector<PyChannel> channels{};
  std::vector<PyRigResult> rigs{};  // of RigMatcher
  StageTimes elapsed_ns;
  // For Forecast.update:
  bool is_ok = false;
  Verdict verdict_value = Verdict::unknown;
  std::uint64_t model_checksum = 0;
};

[[nodiscard]] PyResult to_python(const MatchResult& result, const Model& model);
[[nodiscard]] pybind11::dict to_dict(const PointTally& points);
/// The array's memory. Raises TypeError for what would have to be copied, ValueError for another shape.
[[nodiscard]] std::span<const Point> points_in(const pybind11::object& points);
/// matrix: 3 x 4 or 4 x 4; None: the identity. Raises ValueError for another shape.
[[nodiscard]] RigidTransform transform_from(const pybind11::object& matrix);
/// All but the method and the pose, for this class. Raises TypeError for a name that is none.
[[nodiscard]] MatcherConfig config_from(const std::string& class_name, const pybind11::kwargs& settings);

/// 4 x 4, float64.
[[nodiscard]] pybind11::array matrix(const RigidTransform& T);

void bind_matcher(pybind11::module_& module);
void bind_rigs(pybind11::module_& module);
void bind_history(pybind11::module_& module);
void bind_forecast(pybind11::module_& module);

/// A property for each number, which `numbers_of` finds in an object of this class.
template <class Class, class Numbers>
void add_numbers(Class& type, const Numbers& numbers, auto numbers_of) {
  for (const auto& number : numbers)
    type.def_property_readonly(
        number.name,
        [value = number.value, numbers_of](const typename Class::type& self) { return numbers_of(self).*value; },
        number.meaning);
}

}  // namespace lbea::tool
