// Frames of left-out runs, fitted as the runtime does it.
#pragma once

#include "precompute/left_out/left_out_frames.hpp"
#include "runtime/src/fit/surface_fit.hpp"

namespace lbea::bake {

/// How far a left-out frame's estimate and match are from its shape: mean distances.
struct FrameErrors {
  std::uint32_t simulation = 0;
  std::size_t sample = 0;
  double estimate = 0, match = 0, spread = 0;
  double time_step = 0;                                               // mean of the estimate's samples
  std::vector<std::pair<std::size_t, float>> weights{}, plausible{};  // of the estimate, see Inferred: sample, weight
  std::vector<float> completed{};                                     // image, if something hides a part
};

/// The apparent pose error of a left-out frame, whose pose is right.
struct ApparentMotion {
  PoseBelief posterior;                        // by the image
  std::optional<PoseMeasurement> by_points{};  // of frames whose points are known
  double variance = 0;                         // see PoseFit::variance
  double estimate_error = 0;                   // mean distance
};

/// A left-out frame's image, the samples of other simulations that are proposed for it and, where they are known, its
/// predicted shape scores.
struct LeftOutFrame {
  std::span<const float> observed;
  std::size_t sample;
  std::vector<std::uint32_t> proposed;
  bool is_hidden;
  std::vector<float> predicted{};

  LeftOutFrame(const LeftOutFrames& frames, std::size_t i, const BestSamples& best, bool is_hidden);
};

/// Costs of cells, and prices of weights.
struct FitCosts {
  DepthMetric metric;
  EstimatePrices prices{};
};

/// Matches frames by their proposed samples alone, in a model that has only these.
class LeftOutFitter {
 public:
  /// source: with nodes_of. most: proposed samples per frame. regression: of the source's samples. pose_variance: of
  /// DepthImages.
  LeftOutFitter(const SampleSource& source, const FitCosts& costs, std::size_t most,
                const ShapeRegression& regression = {}, double pose_variance = 0);
  LeftOutFitter(const LeftOutFitter&) = delete;
  LeftOutFitter& operator=(const LeftOutFitter&) = delete;

  /// prior: of the pose, which does not change the errors; none: the pose is known. corrects: moves the estimate to the
  /// frame's points, if the source has any.
  FrameErrors errors(const LeftOutFrame& frame, const PoseBelief* prior = nullptr, bool corrects = false);
  /// calibration: variance of the poses per component. with_points: measures by_points, too.
  ApparentMotion motion(const LeftOutFrame& frame, const PoseMotion& calibration, bool with_points);
  /// Of the component; lengths that follow from it are nearly the same for all samples.
  [[nodiscard]] PoseCenter center() const { return PoseCenter::of(view_); }

 private:
  SurfaceFit match(const LeftOutFrame& frame, const PoseBelief* prior);
  /// Moves the estimate to the frame's points.
  void correct(const LeftOutFrame& frame, SurfaceFit& fit);
  [[nodiscard]] std::vector<Point> points_of(const LeftOutFrame& frame) const;
  [[nodiscard]] ShapeRegression regression_of_proposed() const;
  [[nodiscard]] ModelView view_of();
  [[nodiscard]] std::span<const float> shape(std::size_t candidate) const {
    return std::span(positions_).subspan(candidate * truth_.size(), truth_.size());
  }
  [[nodiscard]] double distance(std::span<const float> shape) const;

  const SampleSource& source_;
  ShapeRegression regression_;
  std::size_t stride_;
  std::vector<std::array<std::uint32_t, 2>> ids_;
  std::vector<std::uint16_t> depths_;
  std::vector<float> shapes_, expected_, observed_;
  std::vector<std::uint16_t> image_;  // of the frame's sample
  std::vector<float> points_;
  std::vector<float> truth_, positions_;
  std::vector<float> landmarks_;  // per proposed sample: nodes of the surface, then those of positions_
  ModelView view_;
  SurfaceFitter fitter_;
  std::optional<CloudIndex> index_;  // of the frame, if it was corrected
};

}  // namespace lbea::bake
