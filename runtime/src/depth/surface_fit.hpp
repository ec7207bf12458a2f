// Method::fit: samples are compared with the frame as depth images, and a combination of the best of them is fitted to
// the frame.
#pragma once

#include "runtime/src/depth/depth_ranking.hpp"
#include "runtime/src/depth/pose_fit.hpp"
#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/match/shape_landmarks.hpp"
#include "runtime/src/match/stopwatch.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

/// The depth image of a frame, and what is known about it.
struct FrameImage {
  std::span<float> observed;           // padded_cells() depths in steps
  bool is_hidden = false;              // something hides a part of the component
  std::span<const float> predicted{};  // shape scores by the regression; none: the candidates alone determine the shape
  // To estimate the pose:
  const PoseBelief* prior = nullptr;
  std::span<const float> points{};  // cells() numbers of points
  bool knows_hidden = false;        // only cells that are not_observed may be hidden
};

/// What the earlier frames of the test say about a frame.
struct FramePrior {
  const PoseBelief* pose = nullptr;               // null: the pose is known
  const FrameExpectation* expectation = nullptr;  // null: nothing
  const HiddenCells* hidden = nullptr;            // null: none
};

class SurfaceFitter {
 public:
  /// Allocates all memory.
  SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches, const FitSettings& settings = {});

  /// `proposed`: samples by eq. 3, in any order. The index must hold at least one point. Does not allocate. The spans
  /// of the result and of matches() are valid until the next call.
  SurfaceFit fit(const CloudIndex& index, std::span<const RankedSample> proposed,
                 const FramePrior& prior = {}) noexcept;
  /// The same for the frame's depth image, by the proposed samples alone. Hidden cells become not_observed. An image
  /// of which something hides a part must be limited to its Surroundings.
  SurfaceFit fit(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  /// The candidates by distance from the estimate and own residual, best first. distance: from the estimate.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept {
    return std::span(matched_).first(matches_.ranked().size());
  }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  /// error_90, also of frames of which too much is hidden for a bound that is published; NaN: not known.
  [[nodiscard]] float error_90() const noexcept { return error_90_; }
  /// Whether a simulation explains the frame.
  [[nodiscard]] bool is_explained() const noexcept {
    return verdict_ == Verdict::matched || verdict_ == Verdict::ambiguous;
  }
  /// Whether something hides a part of the last frame.
  [[nodiscard]] bool is_hidden() const noexcept { return is_hidden_; }
  /// Adds the times of the last frame's parts.
  void add_times(StageTimes& times) const noexcept {
    times.depth_image += times_.depth_image;
    times.ranking += times_.ranking;
    times.estimate += times_.estimate;
    times.judgment += times_.judgment;
  }
  /// The motion that the frame lacks, given the prior.
  [[nodiscard]] const PoseBelief& pose() const noexcept { return pose_; }
  [[nodiscard]] const PoseFit& pose_fit() const noexcept { return pose_fit_; }
  /// The estimate's shape scores, all 0 if the bake has trained no regression.
  [[nodiscard]] const std::array<float, ShapeRegression::shape_scores>& shape() const noexcept { return shape_; }
  /// Mean time of the estimate's samples; its variance over the plausible samples.
  [[nodiscard]] TimeBelief time() const noexcept { return time_; }
  /// What the last frame shows and, in hidden parts, the combination of the candidates. Only after frames of which
  /// something hides a part.
  [[nodiscard]] std::span<const float> completed() const noexcept { return completed_.cells(); }
  /// Whether the last frame is the first of a test and an undeformed sample explains what it shows.
  [[nodiscard]] bool may_be_undeformed() const noexcept { return may_be_undeformed_; }
  /// Adds what something may hide of the last frame. Removes what the frame shows.
  void update(HiddenCells& hidden) noexcept;
  /// Of a depth image.
  [[nodiscard]] std::size_t cells() const noexcept { return views_.data()->camera.cells(); }
  /// Whether the bake knows the residuals of left-out runs. A verdict is then unknown only of frames that show a few
  /// points.
  [[nodiscard]] bool gives_verdicts() const noexcept { return has_expectation_; }
  /// Whether the bake has learned how certain poses are.
  [[nodiscard]] bool estimates_pose() const noexcept { return views_.data()->pose_variance > 0; }
  [[nodiscard]] const FitSettings& settings() const noexcept { return settings_; }

 private:
  float choose_candidates(std::span<float> observed, std::span<const RankedSample> proposed) noexcept;
  void choose_hidden_candidates(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  void set_candidates(float not_residual) noexcept;
  SurfaceFit fit_image(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  SurfaceFit fit_candidates(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  void compare_candidates(const FrameImage& image) noexcept;
  std::size_t gather_residuals(std::size_t cells) noexcept;
  void estimate_pose(const FrameImage& image) noexcept;
  void combine_candidates() noexcept;
  void extrapolate() noexcept;
  [[nodiscard]] float residual_of_combination() const noexcept;
  void begin_estimate() noexcept;
  void use(std::uint32_t row, float weight, std::span<const float> landmarks) noexcept;
  void use_candidates() noexcept;
  [[nodiscard]] std::span<const float> predict_hidden(const FrameImage& image) noexcept;
  void use_neighbors(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  void move_toward(const FrameImage& image) noexcept;
  [[nodiscard]] float least_residual(std::span<const float> observed) noexcept;
  [[nodiscard]] float most_explained(float limited) const noexcept;
  [[nodiscard]] bool is_explained_undeformed(float most) noexcept;
  [[nodiscard]] bool is_explained_with(const HiddenCells& hidden, float most) noexcept;
  void weigh(SurfaceFit& result) noexcept;
  void rank() noexcept;
  /// The history does not decide whether a simulation fits.
  [[nodiscard]] std::size_t best_alone() const noexcept {
    const auto residuals = std::span(residual_alone_).first(count());
    return static_cast<std::size_t>(std::ranges::min_element(residuals) - residuals.begin());
  }
  [[nodiscard]] float least_alone() const noexcept { return residual_alone_[best_alone()]; }
  float spread_alone() noexcept;
  void judge(SurfaceFit& result, const FrameImage& image) noexcept;
  [[nodiscard]] float shown_share(std::span<const float> observed) const noexcept;
  [[nodiscard]] float judged_square(const FrameImage& image) noexcept;
  [[nodiscard]] float price(std::uint32_t sample) const noexcept { return best_.price_per_cost() * costs_[sample]; }
  [[nodiscard]] Sample sample_at(std::uint32_t row) const noexcept {
    return {model_.samples[row][0], model_.samples[row][1]};
  }
  [[nodiscard]] std::size_t count() const noexcept { return best_.ranked().size(); }
  /// For the landmarks of a shape, one per candidate and one more.
  [[nodiscard]] std::span<float> buffer(std::size_t i) noexcept {
    return std::span(landmark_buffer_).subspan(i * shapes_.size(), shapes_.size());
  }

  const ModelView& model_;
  SensorViews views_;
  FitSettings settings_;
  Stopwatch watch_;
  StageTimes times_;
  bool reads_copies_ = false;  // what was copied when this was made; the bake exchanges images and shapes
  const Kernels& code_;
  FrameDepthImage frame_;
  Surroundings surroundings_;
  std::vector<float> limited_;  // the frame's cells without the evidence of what it does not show
  std::vector<float> known_;    // the frame's cells without those that something hid in earlier frames
  bool is_hidden_ = false, may_be_undeformed_ = false;  // the last frame
  ThinnedImages thinned_;
  BestSamples proposed_;                     // by thinned images
  std::vector<RankedSample> ordered_;        // proposed samples, promising ones first
  std::vector<std::uint32_t> filled_cells_;  // per sample
  BestSamples few_;                          // of all samples; thinned images are nearly as good as whole ones
  ExpectationCosts costs_;
  double impact_s_;      // in the time of the samples
  DepthRanking best_;    // by residual
  BestSamples matches_;  // by distance from the estimate and own residual; numbers of candidates, not of samples
  std::vector<RankedSample> matched_;
  std::vector<float> residuals_;          // candidates x cells, depth steps
  std::vector<float> gathered_;           // the same where any of them is not zero
  std::vector<std::uint32_t> lines_;      // first cells of these lines
  std::vector<float> shown_;              // cells: of the frame, that its misfit depends on
  std::vector<float> judged_residual_;    // cells: of the best candidate, tolerant of edges
  std::vector<float> neighbor_residual_;  // cells: of the state before or after a candidate
  std::vector<float> gram_, products_, linear_;
  PoseFit pose_fit_;
  PoseBelief pose_;
  SimplexProblem simplex_;
  RidgeProblem ridge_;
  ShapePredictor predictor_;
  CompletedImage completed_;
  std::vector<float> target_;  // shape scores
  BestSamples neighbors_;      // by distance of their shape scores from the target
  std::vector<float> offsets_, by_score_, neighbor_gram_, weights_, prices_;  // by_score_: offsets_ transposed
  RidgeProblem neighbor_ridge_;
  bool has_expectation_;  // the bake knows the residuals of left-out runs
  ShapeLandmarks shapes_;
  std::vector<float> landmark_buffer_;
  std::vector<std::span<const float>> landmarks_;  // of the candidates
  std::vector<float> estimate_landmarks_;
  std::vector<float> from_best_, from_estimate_, ranks_, plausibility_, shares_;
  std::vector<float> residual_alone_;  // of the candidates, without the price of their costs
  std::vector<Match> candidates_;
  std::vector<WeightedSample> estimate_;
  std::size_t used_ = 0;  // of estimate_
  std::array<float, ShapeRegression::shape_scores> shape_{};
  TimeBelief time_{};
  float filled_ = 1;  // cells that the frame or the best candidate fills
  Verdict verdict_ = Verdict::unknown;
  float error_90_ = std::numeric_limits<float>::quiet_NaN();
};

}  // namespace lbea
