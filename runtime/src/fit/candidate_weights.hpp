// How much each candidate explains a frame: the ranks by which one is the match, and the spread of the plausible ones.
#pragma once

#include "runtime/src/depth/image_comparison.hpp"
#include "runtime/src/depth/test_clock.hpp"
#include "runtime/src/fit/shape_estimate.hpp"

namespace lbea {

class CandidateWeights {
 public:
  /// noise: of DepthMetric. Allocates all memory, for up to `most` candidates.
  CandidateWeights(const ModelView& model, std::size_t most, std::uint32_t max_matches, float noise,
                   const FitSettings& settings);

  /// Ranks the candidates by their distance from the estimate and their residual. alone: per candidate, the residual
  /// without what the history counts, length unit. Sets the lists and the spread of `result`. Does not allocate.
  void weigh(const EstimateProblem& problem, std::span<const float> alone, const ShapeEstimate& estimate,
             SurfaceFit& result) noexcept;
  /// Ranks the same candidates again, by these distances from the estimate and their residual times residual_rank.
  void rank(std::span<const float> from_estimate, float residual_rank, SurfaceFit& result) noexcept;

  /// Best first. distance: from the estimate.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept {
    return std::span(matched_).first(by_rank_.ranked().size());
  }
  /// The candidate with the least residual alone.
  [[nodiscard]] std::size_t best_alone() const noexcept { return best_alone_; }
  /// Mean of a number of each candidate (a function of its sample), weighted by their plausibility.
  template <class Number>
  [[nodiscard]] float plausible_mean(const Number& number) const noexcept {
    float all = 0, sum = 0;
    for (std::size_t i = 0; i < problem_.samples.size(); ++i) {
      all += plausibility_[i];
      sum += plausibility_[i] * number(problem_.samples[i].sample);
    }
    return sum / all;
  }
  [[nodiscard]] Verdict verdict(float misfit, float limit, std::span<const float> from_best) const noexcept;
  /// Of the times of the samples that are plausible by the frame alone, s^2.
  [[nodiscard]] double time_variance() const noexcept { return time_variance_; }

 private:
  void set_spread(std::span<const float> alone, const ShapeEstimate& estimate, SurfaceFit& result) noexcept;
  void set_plausibilities() noexcept;
  [[nodiscard]] bool are_several_plausible(std::span<const float> from_best) const noexcept;

  const ModelView& model_;
  FitSettings settings_;
  float noise_;
  EstimateProblem problem_{};
  BestSamples by_rank_;  // numbers of candidates, not of samples
  std::vector<RankedSample> matched_;
  std::vector<float> ranks_, plausibility_;  // per candidate
  std::size_t best_alone_ = 0;
  double time_variance_ = 0;
};

}  // namespace lbea
