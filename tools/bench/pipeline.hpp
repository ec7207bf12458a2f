// Pipelines from a frame to its matches. All of them must find the same matches.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "tools/bench/answer.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool::bench {

class Pipeline {
 public:
  virtual ~Pipeline() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// The timed part: from the points of the frame to ranked samples. Returns the wall time of each stage, 0 for stages
  /// that this pipeline does not have.
  virtual StageTimes match(const Frame& frame) = 0;
  /// The result of match(), for the check. Not timed.
  [[nodiscard]] virtual Answer answer(const Frame& frame) = 0;
};

/// The product: Matcher as applications use it.
[[nodiscard]] std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config);

/// The same stages with the loops of one instruction set. name: its name in tables.
[[nodiscard]] std::unique_ptr<Pipeline> kernels_pipeline(const Model& model, const MatcherConfig& config,
                                                         const Kernels& code, std::string name);

/// A baseline from libraries: a nanoflann tree per frame, Eigen's matrix product, a loop over all samples. No coverage.
[[nodiscard]] std::unique_ptr<Pipeline> nanoflann_pipeline(const Model& model, const MatcherConfig& config);

/// "avx512", "avx2", "baseline".
[[nodiscard]] std::string short_name(const Kernels& code);
/// Throws Error{bad_config} with the names that this processor supports.
[[nodiscard]] const Kernels& kernels_named(const std::string& name);

}  // namespace lbea::tool::bench
