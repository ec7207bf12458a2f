// Pipelines from a frame to its matches. All of them must find the same matches.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "tools/bench/answer.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool::bench {

/// Wall time of each stage, ns; 0 for stages that a pipeline does not have.
struct PipelineTimes {
  StageTimes stages{};
  std::uint32_t track = 0, infer = 0;
};

/// What follows method fit in a frame.
struct FitExtras {
  bool tracks = false;                    // with the tracker and the history of the test, as lbea-serve
  std::optional<std::uint32_t> inferred;  // a field of the model
};

class Pipeline {
 public:
  virtual ~Pipeline() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// The timed part: from the points of the frame to ranked samples.
  virtual PipelineTimes match(const Frame& frame) = 0;
  /// The result of match(), for the check. Not timed.
  [[nodiscard]] virtual Answer answer(const Frame& frame) = 0;
};

/// The product: Matcher as applications use it, by lbea or vtp.
[[nodiscard]] std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config);

/// What proposes samples to Method::fit.
[[nodiscard]] MatcherConfig proposing(MatcherConfig config);

/// The product by Method::fit.
[[nodiscard]] std::unique_ptr<Pipeline> fit_pipeline(const Model& model, const MatcherConfig& config,
                                                     const FitExtras& extras = {});

/// A baseline for it: the nanoflann pipeline proposes samples, plain loops make the frame's depth image and compare it
/// with theirs. It ends with the candidates: no estimate, no verdict, no coverage.
[[nodiscard]] std::unique_ptr<Pipeline> plain_fit_pipeline(const Model& model, const MatcherConfig& config);

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
