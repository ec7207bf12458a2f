// Between the samples: the convex combination that explains the frame best.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace lbea {

/// minimise w' G w + c' w over the simplex { w >= 0, sum w = 1 } by an accelerated projected gradient (FISTA).
class SimplexProblem {
 public:
  explicit SimplexProblem(std::size_t most) : w_(most), ahead_(most), next_(most), sorted_(most) {}
  /// gram: k x stride, symmetric and positive semi-definite; linear: k. The answer is valid until the next call.
  /// No allocation; k may not be more than `most`.
  std::span<const float> solve(std::span<const float> gram, std::size_t stride, std::span<const float> linear) noexcept;

 private:
  void project(std::span<float> values) noexcept;

  std::vector<float> w_, ahead_, next_, sorted_;
};

}  // namespace lbea
