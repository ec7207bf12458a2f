#include "tools/bench/pipeline.hpp"

#include <algorithm>

namespace lbea::tool::bench {
namespace {

class MatcherPipeline : public Pipeline {
 public:
  MatcherPipeline(const Model& model, const MatcherConfig& config) : config_(config), matcher_(model, config) {}

  [[nodiscard]] std::string name() const override { return "lbea"; }

  StageTimes match(const Frame& frame) override { return matcher_.match(frame).elapsed_ns; }

  // A result does not carry the nearest points: they come from the same stages in the open. That they are the
  // matcher's own shows in the coefficients, which must have the same bits.
  [[nodiscard]] Answer answer(const Frame& frame) override {
    if (!open_stages_) open_stages_ = kernels_pipeline(matcher_.model(), config_, kernels(), name());
    Answer answer = open_stages_->answer(frame);
    const MatchResult result = matcher_.match(frame);
    if (!std::ranges::equal(result.coefficients, answer.coefficients))
      throw Error(Status::bad_input, "frame " + std::to_string(frame.id) +
                                         ": the matcher's coefficients are not those of its stages run one by one");
    answer.reference = result.reference;
    answer.ranked.clear();
    for (const Match& match : result.matches)
      answer.ranked.push_back({matcher_.model().sample_index(match.sample), match.distance});
    return answer;
  }

 private:
  MatcherConfig config_;
  Matcher matcher_;
  std::unique_ptr<Pipeline> open_stages_;  // made for the check
};

}  // namespace

std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config) {
  return std::make_unique<MatcherPipeline>(model, config);
}

}  // namespace lbea::tool::bench
