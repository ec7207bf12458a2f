#include "tools/bench/pipeline.hpp"

namespace lbea::bench {

namespace {

class MatcherPipeline : public Pipeline {
 public:
  MatcherPipeline(const Model& model, const MatcherConfig& config) : config_(config), matcher_(model, config) {}

  [[nodiscard]] std::string name() const override { return "lbea"; }

  StageTimes match(const Frame& frame) override { return matcher_.match(frame).elapsed_ns; }

  // A result does not carry the nearest points: they come from the same stages in the open, and the check holds
  // the matcher's coefficients against them.
  [[nodiscard]] Answer answer(const Frame& frame) override {
    Answer answer;
    answer.points = kernels_pipeline(matcher_.model(), config_, kernels())->answer(frame).points;
    const MatchResult result = matcher_.match(frame);
    answer.reference = result.reference;
    answer.coefficients.assign(result.coefficients.begin(), result.coefficients.end());
    for (const Match& match : result.matches)
      answer.ranked.push_back({matcher_.model().sample_index(match.sample), match.distance});
    return answer;
  }

 private:
  MatcherConfig config_;
  Matcher matcher_;
};

}  // namespace

std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config) {
  return std::make_unique<MatcherPipeline>(model, config);
}

}  // namespace lbea::bench
