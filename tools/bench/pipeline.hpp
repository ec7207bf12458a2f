// What is timed: ways from a frame to its matches that must all find the same.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "tools/bench/answer.hpp"

#include <lbea/lbea.hpp>

#include <memory>
#include <string>

namespace lbea::tool::bench {

class Pipeline {
 public:
  virtual ~Pipeline() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// The timed part: from the frame's points to ranked samples. Wall time of each stage, 0 for those it does not have.
  virtual StageTimes match(const Frame& frame) = 0;
  /// What match() finds, for the check. Not timed.
  [[nodiscard]] virtual Answer answer(const Frame& frame) = 0;
};

/// The product: Matcher as applications use it.
[[nodiscard]] std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config);

/// The same stages with the loops of one instruction set, under the name it goes by in tables.
[[nodiscard]] std::unique_ptr<Pipeline> kernels_pipeline(const Model& model, const MatcherConfig& config,
                                                         const Kernels& code, std::string name);

/// Plainly from libraries: a nanoflann tree per frame, Eigen's product, a loop over all samples. No coverage.
[[nodiscard]] std::unique_ptr<Pipeline> nanoflann_pipeline(const Model& model, const MatcherConfig& config);

/// "avx512", "avx2", "baseline".
[[nodiscard]] std::string short_name(const Kernels& code);
/// Throws Error{bad_config} that lists the names this processor runs.
[[nodiscard]] const Kernels& kernels_named(const std::string& name);

}  // namespace lbea::tool::bench
