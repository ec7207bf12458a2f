// Method::fit, second half: the combination of candidates that explains a frame best, and the shape between it and what
// the regression predicts.
#pragma once

#include "runtime/src/depth/combination.hpp"
#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/fit/candidate_search.hpp"
#include "runtime/src/fit/pose_fit.hpp"
#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {

class ShapeEstimate {
 public:
  /// search: whose candidates are combined. Keeps references to all but the settings. Allocates all memory.
  ShapeEstimate(const ModelView& model, const DepthImages& images, CandidateSearch& search,
                const FitSettings& settings);

  /// Sets the residuals of the candidates, their mean products, and their distances from the best one. Does not
  /// allocate.
  void compare() noexcept;
  /// What the compared candidates say about the pose.
  [[nodiscard]] PoseProblem pose_problem() const noexcept;
  /// Of an image of which nothing is hidden: see ShapePredictor. Does not allocate.
  [[nodiscard]] std::span<const float> predict(std::span<const float> observed) noexcept {
    return predictor_.predict(observed);
  }
  /// Combines the compared candidates; without a prediction of the image, of its own. Does not allocate.
  void combine(std::span<const float> predicted) noexcept;

  /// Residual of the combination of candidates, length unit.
  [[nodiscard]] float residual() const noexcept { return residual_; }
  [[nodiscard]] std::span<const WeightedSample> samples() const noexcept { return std::span(samples_).first(used_); }
  /// Per candidate: mean distance of the component's nodes, length unit.
  [[nodiscard]] std::span<const float> from_best() const noexcept { return std::span(from_best_).first(count()); }
  [[nodiscard]] std::span<const float> from_estimate() const noexcept {
    return std::span(from_estimate_).first(count());
  }
  /// Shape scores, all 0 if the bake has trained no regression.
  [[nodiscard]] const std::array<float, ShapeRegression::shape_scores>& shape() const noexcept { return shape_; }
  /// Mean time of the samples, s.
  [[nodiscard]] double time_s() const noexcept { return time_s_; }
  /// What the frame shows and, in hidden parts, the combination of the candidates. Only of frames of which something
  /// hides a part.
  [[nodiscard]] std::span<const float> completed() const noexcept { return completed_.cells(); }

 private:
  std::size_t gather_residuals(std::size_t cells) noexcept;
  void combine_candidates() noexcept;
  void extrapolate() noexcept;
  [[nodiscard]] float residual_of_combination() const noexcept;
  void use_candidates() noexcept;
  void begin() noexcept;
  void use(std::uint32_t sample, float weight, std::span<const float> landmarks) noexcept;
  [[nodiscard]] std::span<const float> predict_hidden(std::span<const float> predicted) noexcept;
  void move_toward(std::span<const float> predicted) noexcept;
  void use_neighbors() noexcept;
  [[nodiscard]] float compare_neighbors() noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return search_.count(); }
  [[nodiscard]] std::span<float> residuals(std::size_t candidate) noexcept {
    const std::size_t cells = padded_cells(images_.camera);
    return std::span(residuals_).subspan(candidate * cells, cells);
  }
  /// For the landmarks of a shape, one per candidate and one more.
  [[nodiscard]] std::span<float> buffer(std::size_t i) noexcept {
    return std::span(landmark_buffer_).subspan(i * shapes_.size(), shapes_.size());
  }

  const ModelView& model_;
  const DepthImages& images_;
  CandidateSearch& search_;
  FitSettings settings_;
  const Kernels& code_;
  ShapeLandmarks shapes_;
  std::vector<float> landmark_buffer_;
  std::vector<std::span<const float>> landmarks_;  // of the candidates
  std::vector<float> from_best_, from_estimate_;
  std::vector<float> residuals_;      // candidates x cells, depth steps
  std::vector<float> gathered_;       // the same where any of them is not zero
  std::vector<std::uint32_t> lines_;  // first cells of these lines
  float filled_ = 1;                  // cells that the frame or the best candidate fills
  std::vector<float> gram_, products_, linear_, shares_;
  SimplexProblem simplex_;
  RidgeProblem ridge_;
  float residual_ = 0;
  ShapePredictor predictor_;
  CompletedImage completed_;
  std::vector<float> target_;  // shape scores
  BestSamples neighbors_;      // by distance of their shape scores from the target
  std::vector<float> offsets_, by_score_, neighbor_gram_, weights_, prices_;  // by_score_: offsets_ transposed
  RidgeProblem neighbor_ridge_;
  std::vector<WeightedSample> samples_;
  std::size_t used_ = 0;                   // of samples_
  std::vector<float> estimate_landmarks_;  // weighted sums over them, as the next two
  std::array<float, ShapeRegression::shape_scores> shape_{};
  double time_s_ = 0;
};

}  // namespace lbea
