// Method::fit, second half: the combination of candidates that explains a frame best, and the shape between it and what
// the regression predicts.
#pragma once

#include "runtime/src/depth/combination.hpp"
#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {

/// What is combined.
struct EstimateProblem {
  std::span<const RankedSample> samples;   // k candidates, best first
  std::span<const Match> candidates;       // the same; distance: residual, length unit
  std::span<const float> gram;             // k x k: mean products of the residuals, length unit squared
  std::span<const RankedSample> proposed;  // the samples that they were chosen from
  bool is_hidden = false;                  // something hides a part of the component
  bool reads_copies = true;                // see CandidateSearch
};

/// Shape scores by the regression. Without scores, the candidates alone determine the estimate.
struct ShapePrediction {
  std::span<const float> scores{};
  float blend = 0, most_difference = 0;  // of ShapeRegression

  /// As the regression's, of a frame of which something hides a part or not.
  [[nodiscard]] static ShapePrediction of(std::span<const float> scores, const ShapeRegression& regression,
                                          bool is_hidden) noexcept {
    if (is_hidden) return {scores, regression.hidden_blend, regression.hidden_most_difference};
    return {scores, regression.blend, regression.most_difference};
  }
};

class ShapeEstimate {
 public:
  static constexpr std::uint32_t most_nearest = 8;

  /// Keeps references to the model and to the regression's memory. Allocates all memory, for up to `most` candidates.
  ShapeEstimate(const ModelView& model, const ShapeRegression& regression, std::size_t most,
                const FitSettings& settings);

  /// Begins the estimate of a frame: sets the distances of the candidates from the best one. The problem's spans must
  /// remain valid until the last call for the frame. Does not allocate.
  void begin(const EstimateProblem& problem) noexcept;
  /// Sets the candidates' shares. Does not allocate.
  void combine() noexcept;
  /// Takes the combination of candidates, moved toward the prediction. Does not allocate.
  void follow(const ShapePrediction& prediction) noexcept;

  /// Replaces the weights of samples(), and drops those with weight 0. Their sum must be 1. The time remains. Does not
  /// allocate.
  void reweigh(std::span<const float> weights) noexcept;

  /// See CandidateSearch.
  [[nodiscard]] bool reads_copies() const noexcept { return problem_.reads_copies; }
  /// Per candidate, in their combination.
  [[nodiscard]] std::span<const float> shares() const noexcept { return std::span(shares_).first(count()); }
  /// Residual of the combination of candidates, length unit.
  [[nodiscard]] float residual() const noexcept { return residual_; }
  [[nodiscard]] std::span<const WeightedSample> samples() const noexcept { return std::span(samples_).first(used_); }
  /// The same samples, as numbers of the model.
  [[nodiscard]] std::span<const std::uint32_t> numbers() const noexcept { return std::span(numbers_).first(used_); }
  /// Per candidate: mean distance of the component's nodes, length unit.
  [[nodiscard]] std::span<const float> from_best() const noexcept { return std::span(from_best_).first(count()); }
  [[nodiscard]] std::span<const float> from_estimate() const noexcept {
    return std::span(from_estimate_).first(count());
  }
  /// The candidates nearest to the estimate, at most most_nearest, nearest first.
  [[nodiscard]] std::span<const RankedSample> nearest() const noexcept { return nearest_.ranked(); }
  /// Shape scores, all 0 if the bake has trained no regression.
  [[nodiscard]] const std::array<float, ShapeRegression::shape_scores>& shape() const noexcept { return shape_; }
  /// Mean time of the samples, s.
  [[nodiscard]] double time_s() const noexcept { return time_s_; }

 private:
  void combine_candidates() noexcept;
  void extrapolate() noexcept;
  [[nodiscard]] float residual_of_combination() const noexcept;
  void use_candidates() noexcept;
  void clear() noexcept;
  void use(std::uint32_t sample, float weight, std::span<const float> landmarks) noexcept;
  void measure_candidates() noexcept;
  void move_toward(const ShapePrediction& prediction) noexcept;
  void use_neighbors() noexcept;
  [[nodiscard]] float compare_neighbors() noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return problem_.samples.size(); }
  /// For the landmarks of a shape, one per candidate and one more.
  [[nodiscard]] std::span<float> buffer(std::size_t i) noexcept {
    return std::span(landmark_buffer_).subspan(i * shapes_.size(), shapes_.size());
  }

  const ModelView& model_;
  const Kernels& code_;
  ShapeRegression regression_;
  FitSettings settings_;
  ShapeLandmarks shapes_;
  EstimateProblem problem_{};
  std::vector<float> landmark_buffer_;
  std::vector<std::span<const float>> landmarks_;  // of the candidates
  std::vector<float> from_best_, from_estimate_;
  BestSamples nearest_;
  std::vector<float> linear_, shares_;
  SimplexProblem simplex_;
  RidgeProblem ridge_;
  float residual_ = 0;
  std::vector<float> target_;  // shape scores
  BestSamples neighbors_;      // by distance of their shape scores from the target
  std::vector<float> offsets_, by_score_, neighbor_gram_, weights_, prices_;  // by_score_: offsets_ transposed
  RidgeProblem neighbor_ridge_;
  std::vector<WeightedSample> samples_;
  std::vector<std::uint32_t> numbers_;     // of the same samples
  std::size_t used_ = 0;                   // of samples_
  std::vector<float> estimate_landmarks_;  // weighted sums over them, as the next two
  std::array<float, ShapeRegression::shape_scores> shape_{};
  double time_s_ = 0;
};

}  // namespace lbea
