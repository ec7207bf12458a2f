// Method::fit: samples are compared with the frame as depth images, and a combination of the best of them is fitted to
// the frame.
#pragma once

#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

/// Minimizes w' G w + c' w over the simplex { w >= 0, sum w = 1 } by an accelerated projected gradient (FISTA).
class SimplexProblem {
 public:
  explicit SimplexProblem(std::size_t most) : w_(most), ahead_(most), next_(most), sorted_(most) {}
  /// gram: k x stride, symmetric and positive semi-definite; linear: k values, at most `most`. Returns w, valid until
  /// the next call. Does not allocate.
  std::span<const float> solve(std::span<const float> gram, std::size_t stride, std::span<const float> linear) noexcept;

 private:
  void project(std::span<float> values) noexcept;

  std::vector<float> w_, ahead_, next_, sorted_;
};

/// Minimizes w' G w + (w - w0)' P (w - w0) subject to sum w = 1, P diagonal: ridge regression about w0, by a Cholesky
/// factorization.
class RidgeProblem {
 public:
  explicit RidgeProblem(std::size_t most) : factor_(most * most), change_(most), ones_(most) {}
  /// gram: k x stride, symmetric and positive semi-definite; prices: P, all positive; w: w0, replaced by the solution.
  /// Does not allocate.
  void solve(std::span<const float> gram, std::size_t stride, std::span<const float> prices,
             std::span<float> w) noexcept;

 private:
  void factorize(std::span<const float> gram, std::size_t stride, std::span<const float> prices) noexcept;
  void substitute(std::span<double> values) const noexcept;

  std::vector<double> factor_, change_, ones_;
};

struct FitSettings {
  std::uint32_t proposals = 256;  // samples whose depth images are compared
  std::uint32_t candidates = 24;  // the best of them, which the estimate combines
  // Something hides a part of the component if no sample explains the whole frame: if the least squared residual is
  // more than this times the least one without the cells far from what the frame shows
  float hidden = 1.6f;
  // Cost of a sample's share in the estimate, added to the squared residual of the combination:
  float residual_price = 0.2f;   // times the sample's squared residual
  float distance_price = 0.05f;  // times its squared mean distance from the best candidate: a blend of two deformation
                                 // branches is not a possible shape
  // Cost of leaving the convex combination, so that the estimate can lie beside the candidates, per squared change of a
  // share. Where something hides a part the combination stays convex.
  float change_price = 0.3f;           // times the candidates' mean squared residual
  float change_distance_price = 0.5f;  // times the candidate's squared mean distance from the best one
  // The estimate is a combination of the samples nearest to the shape between the candidates' combination and the
  // regression's prediction. Price of the squared weights, which keeps them small:
  std::uint32_t neighbors = 48;
  float neighbor_price = 0.01f;  // times the neighbors' mean squared distance from that shape
  // Rank of a candidate: squared mean distance from the estimate, plus this times its squared residual
  float residual_rank = 0.2f;
  float sharpness = 8;  // of the Plausibility

  /// Most samples in an estimate.
  [[nodiscard]] constexpr std::uint32_t most_combined() const noexcept { return std::max(candidates, neighbors); }
};

class SurfaceFitter {
 public:
  /// Allocates all memory.
  SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches, const FitSettings& settings = {});

  /// `proposed`: samples by eq. 3, in any order. The index must hold at least one point. Does not allocate. The spans
  /// of the result and of matches() are valid until the next call.
  SurfaceFit fit(const CloudIndex& index, std::span<const RankedSample> proposed) noexcept;
  /// The same for the frame's depth image, by the proposed samples alone. observed: padded_cells() values, of which
  /// hidden cells become not_observed. is_hidden: whether something hides a part of the component. predicted: shape
  /// scores by the regression; none: the candidates alone determine the estimate.
  SurfaceFit fit(std::span<float> observed, std::span<const RankedSample> proposed, bool is_hidden = false,
                 std::span<const float> predicted = {}) noexcept;
  /// The candidates by distance from the estimate and own residual, best first. distance: from the estimate.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept {
    return std::span(matched_).first(matches_.ranked().size());
  }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  [[nodiscard]] const FitSettings& settings() const noexcept { return settings_; }

 private:
  float choose_candidates(std::span<float> observed, std::span<const RankedSample> proposed) noexcept;
  SurfaceFit fit_candidates(std::span<const float> observed, std::span<const RankedSample> proposed, bool is_hidden,
                            std::span<const float> predicted) noexcept;
  void combine_candidates(std::span<const float> observed) noexcept;
  void extrapolate() noexcept;
  [[nodiscard]] float residual_of_combination() const noexcept;
  void use_candidates() noexcept;
  void use_neighbors(std::span<const float> predicted, std::span<const RankedSample> proposed) noexcept;
  void move_toward(std::span<const float> predicted) noexcept;
  [[nodiscard]] float least_limited_residual() noexcept;
  void weigh(SurfaceFit& result) noexcept;
  void rank() noexcept;
  void judge(SurfaceFit& result, bool is_hidden) noexcept;
  [[nodiscard]] Sample sample_at(std::uint32_t row) const noexcept {
    return {model_.samples[row][0], model_.samples[row][1]};
  }
  void copy_landmarks(std::uint32_t sample, std::span<float> into) const noexcept;
  [[nodiscard]] float mean_distance(std::span<const float> a, std::span<const float> b) const noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return best_.ranked().size(); }
  [[nodiscard]] std::span<float> landmarks(std::size_t candidate) noexcept {
    return std::span(landmarks_).subspan(candidate * landmark_floats_, landmark_floats_);
  }

  const ModelView& model_;
  SensorViews views_;
  FitSettings settings_;
  const Kernels& code_;
  FrameDepthImage frame_;
  Surroundings surroundings_;
  std::vector<float> limited_;  // the frame's cells without the evidence of what it does not show
  ThinnedImages thinned_;
  BestSamples proposed_;
  DepthRanking best_;    // by residual
  BestSamples matches_;  // by distance from the estimate and own residual; numbers of candidates, not of samples
  std::vector<RankedSample> matched_;
  std::vector<float> residuals_;  // candidates x cells, depth steps
  std::vector<float> gram_, products_, linear_;
  SimplexProblem simplex_;
  RidgeProblem ridge_;
  ShapePredictor predictor_;
  std::vector<float> target_;  // shape scores
  BestSamples neighbors_;      // by distance of their shape scores from the target
  std::vector<float> offsets_, neighbor_gram_, weights_, prices_;
  RidgeProblem neighbor_ridge_;
  std::vector<std::uint32_t> landmark_places_;
  std::size_t landmark_floats_;
  std::vector<float> landmarks_, estimate_landmarks_,
      neighbor_landmarks_;  // candidates x 3 x landmarks; one shape each
  std::vector<float> from_best_, from_estimate_, ranks_, plausibility_, shares_;
  std::vector<Match> candidates_;
  std::vector<WeightedSample> estimate_;
  std::size_t used_ = 0;  // of estimate_
  float filled_ = 1;      // cells that the frame or the best candidate fills
  Verdict verdict_ = Verdict::unknown;
};

}  // namespace lbea
