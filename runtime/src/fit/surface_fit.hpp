// Method::fit: samples are compared with the frame as depth images, and a combination of the best of them is fitted to
// the frame.
#pragma once

#include "runtime/src/fit/candidate_weights.hpp"
#include "runtime/src/fit/image_residuals.hpp"
#include "runtime/src/fit/surface_pose.hpp"
#include "runtime/src/match/stopwatch.hpp"
#include "runtime/src/pose/pose_fit.hpp"

namespace lbea {

/// A few stray points are no evidence for or against the samples: share of the component that a frame must show.
inline constexpr float least_judged = 0.1f;
/// The same for a bound of the error, where something hides a part: the bake learns the errors of frames of which a
/// third is hidden.
inline constexpr float least_bounded = 0.5f;

class SurfaceFitter {
 public:
  /// most_compared: candidates of a JointFitter. Allocates all memory.
  SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches, const FitSettings& settings = {},
                std::uint32_t most_compared = 0);
  SurfaceFitter(const SurfaceFitter&) = delete;
  SurfaceFitter& operator=(const SurfaceFitter&) = delete;

  /// `proposed`: samples by eq. 3, in any order. The index must hold at least one point. Does not allocate. The spans
  /// of the result and of matches() are valid until the next call.
  SurfaceFit fit(const CloudIndex& index, std::span<const RankedSample> proposed,
                 const FramePrior& prior = {}) noexcept;
  /// The same for the frame's depth image, by the proposed samples alone: see CandidateSearch.
  SurfaceFit fit(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;
  /// Moves the estimate of the latest fit to the points of its index, and ranks the candidates again. With a full view,
  /// one sample becomes the estimate if it is likelier than their combination. Spread, time and verdict remain those of
  /// the uncorrected estimate. Does not allocate.
  void correct(const CloudIndex& index, SurfaceFit& result) noexcept;
  /// The first step of it, of any estimate: compares that with the points of the latest fit's index. states: of its
  /// samples when the frame was captured; empty: those samples. Does not allocate.
  void begin_correction(const ShapeEstimate& of, const CloudIndex& index,
                        std::span<const StateBetween> states = {}) noexcept;

  /// The candidates by distance from the estimate and own residual, best first. distance: from the estimate.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept { return weights_.matches(); }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  /// error_90, also of frames of which too much is hidden for a bound that is published; NaN: not known.
  [[nodiscard]] float error_90() const noexcept { return error_90_; }
  /// Whether a simulation explains the frame.
  [[nodiscard]] bool is_explained() const noexcept {
    return verdict_ == Verdict::matched || verdict_ == Verdict::ambiguous;
  }
  /// Whether something hides a part of the last frame.
  [[nodiscard]] bool is_hidden() const noexcept { return search_.image().is_hidden; }
  /// Then, the best candidate's residual, length unit.
  [[nodiscard]] std::optional<float> hidden_residual() const noexcept {
    return is_hidden() ? std::optional(search_.candidates()[0].distance) : std::nullopt;
  }
  /// Adds the times of the last frame's parts.
  void add_times(StageTimes& times) const noexcept;
  /// The motion that the frame lacks, given the prior.
  [[nodiscard]] const PoseBelief& pose() const noexcept { return pose_; }
  [[nodiscard]] const PoseFit& pose_fit() const noexcept { return pose_fit_; }
  /// The same by the points of the frame that was corrected; nothing if they show nothing near the estimate.
  [[nodiscard]] std::optional<PoseMeasurement> pose_by_points(const PoseMotion& calibration) noexcept;
  [[nodiscard]] const CandidateSearch& search() const noexcept { return search_; }
  [[nodiscard]] const ShapeEstimate& estimate() const noexcept { return estimate_; }
  /// What the frame shows and, in hidden parts, the combination of the candidates. Only of frames of which something
  /// hides a part.
  [[nodiscard]] std::span<const float> completed() const noexcept { return residuals_.completed(); }
  /// Mean time of the estimate's samples; its variance over the plausible samples.
  [[nodiscard]] TimeBelief time() const noexcept { return {estimate_.time_s(), weights_.time_variance()}; }
  /// Adds what something may hide of the last frame. Removes what the frame shows.
  void update(HiddenCells& hidden) noexcept { search_.update(hidden); }
  /// Number of cells that the frame shows, relative to those that a sample fills.
  [[nodiscard]] float shown_share(std::uint32_t sample) const noexcept;
  /// Whether cells of the last frame may be empty by chance, so that nothing tells whether a simulation fits.
  [[nodiscard]] bool is_sparse(float shown_share) const noexcept;
  /// A sample's squared residual, tolerant of edges, of what the frame shows, in squared length units; after
  /// interpolation to the state before or after it, if less than half remains then.
  [[nodiscard]] float judged_square(std::uint32_t sample) noexcept;
  /// Of a depth image.
  [[nodiscard]] std::size_t cells() const noexcept { return views_.data()->camera.cells(); }
  /// Whether the bake knows the residuals of left-out runs. A verdict is then unknown only of frames that show a few
  /// points.
  [[nodiscard]] bool gives_verdicts() const noexcept { return has_expectation_; }
  /// Whether the bake has learned how certain poses are.
  [[nodiscard]] bool estimates_pose() const noexcept { return views_.data()->pose_variance > 0; }
  [[nodiscard]] const FitSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const SensorViews& views() const noexcept { return views_; }
  [[nodiscard]] const DepthImages& images() const noexcept { return *views_.data(); }
  /// Of frames like the last one; see DepthImages. 0: not known.
  [[nodiscard]] const ErrorBound& error_bound() const noexcept {
    return is_hidden() ? images().hidden_error_bound : images().error_bound;
  }

  // The last frame, compared with other candidates by another metric: see JointFitter.
  void compare_again(const DepthMetric& metric) noexcept;
  /// After compare_again(): of a sample, squared length units.
  [[nodiscard]] SquareSums squares_of(std::uint32_t sample) noexcept;
  /// The same without what something may hide. Ends the comparison.
  [[nodiscard]] SquareSums shown_squares_of(std::uint32_t sample) noexcept;
  [[nodiscard]] ImageResiduals& residuals() noexcept { return residuals_; }
  [[nodiscard]] SurfaceCorrection& correction() noexcept { return correction_; }
  /// The motion that the frame lacks by its residuals() and the mean products of `problem`, over so many cells.
  [[nodiscard]] const PoseBelief& pose_by(const EstimateProblem& problem, std::span<const float> from_best, float cells,
                                          const PoseBelief& prior) noexcept;
  /// By the regression, of the frame; in hidden parts, completed by the candidates of residuals().
  [[nodiscard]] ShapePrediction predict_again(std::span<const float> shares) noexcept;

 private:
  SurfaceFit fit_candidates(std::span<const float> predicted) noexcept;
  void compare() noexcept;
  [[nodiscard]] std::span<const float> predict_hidden(std::span<const float> predicted) noexcept;
  [[nodiscard]] EstimateProblem problem() const noexcept;
  void judge(SurfaceFit& result) noexcept;
  void set_misfit(SurfaceFit& result) noexcept;

  const ModelView& model_;
  SensorViews views_;
  FitSettings settings_;
  const Kernels& code_;
  Stopwatch watch_;
  StageTimes times_;  // of the last frame's parts
  CandidateSearch search_;
  ImageResiduals residuals_;
  std::span<const float> predicted_;  // of a frame of which nothing is hidden
  std::vector<float> gram_;           // mean products of the candidates' residuals, length unit squared
  ShapeEstimate estimate_;
  SurfaceCorrection correction_;
  SurfacePose surface_pose_;
  PoseFit pose_fit_;
  PoseBelief pose_;
  CandidateWeights weights_;
  std::vector<float> shown_;              // cells: of the frame, that its misfit depends on
  std::vector<float> judged_residual_;    // cells: of the best candidate, tolerant of edges
  std::vector<float> neighbor_residual_;  // cells: of the state before or after a candidate
  bool has_expectation_;                  // the bake knows the residuals of left-out runs
  Verdict verdict_ = Verdict::unknown;
  float error_90_ = std::numeric_limits<float>::quiet_NaN();
};

}  // namespace lbea
