// Parts of the Python module `lbea`.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/test_history.hpp>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <atomic>

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

/// 4 x 4, float64.
[[nodiscard]] pybind11::array matrix(const RigidTransform& T);

void bind_matcher(pybind11::module_& module);
void bind_history(pybind11::module_& module);

}  // namespace lbea::tool
