// The pose error of a test: the rigid motion that T_reference_sensor lacks, constant or drifting, as estimated from the
// frames so far.
#pragma once

#include "runtime/src/depth/pose.hpp"
#include "runtime/src/depth/test_clock.hpp"

#include <optional>

namespace lbea {

/// Standard deviation of a drift after one duration of a simulation, in those of the calibration.
inline constexpr double usual_drift_rate = 0.5;

/// What one frame says about the motion.
struct PoseMeasurement {
  PoseMotion motion{};
  PoseMatrix covariance{};
  /// What a posterior adds to its prior. calibration: variance per component, the bound of unmeasured directions.
  static PoseMeasurement between(const PoseBelief& prior, const PoseBelief& posterior,
                                 const PoseMotion& calibration) noexcept;
  /// Its covariance where frames are as wrong as this: see PoseSpreads.
  [[nodiscard]] PoseMatrix covariance_with(const PoseMatrix& spread) const noexcept;
  /// As if both were independent.
  [[nodiscard]] PoseMeasurement together_with(const PoseMeasurement& other) const noexcept;
};

/// A Kalman filter of the motion, its rate, and the error of the measurements. Times are in durations of a simulation.
///
/// A run that is not in the ensemble seems moved in the same way in all its frames: their errors are not independent.
/// So the error is a state, too, in units of its standard deviation: an autoregressive process of order 1.
class PoseTrajectory {
 public:
  /// Of a constant motion. calibration: variance per component.
  explicit PoseTrajectory(const PoseMotion& calibration) noexcept;
  /// The same until now, drifting from now on.
  [[nodiscard]] PoseTrajectory drifting() const noexcept;
  void advance(double elapsed) noexcept;
  /// Returns the logarithm of the measurement's likelihood, up to a constant.
  double update(const PoseMeasurement& measured) noexcept;
  [[nodiscard]] PoseMotion motion() const noexcept;
  [[nodiscard]] PoseMatrix covariance() const noexcept;

 private:
  static constexpr std::size_t n = 18, rate = 6, error = 12;  // first of the rates, of the errors
  [[nodiscard]] double& at(std::size_t row, std::size_t column) noexcept { return covariance_[n * row + column]; }

  PoseMotion calibration_;
  std::array<double, n> mean_{};
  std::array<double, n * n> covariance_{};
};

/// Whether the motion drifts: a drift may begin with any frame, and the evidence of one that did not is forgotten
/// (cumulative sum test, Page 1954).
class DriftTest {
 public:
  /// enough: evidence of a drift, from which on the test is regarded as drifting.
  DriftTest(const PoseMotion& calibration, double enough) noexcept;
  void advance(double elapsed) noexcept;
  /// is_evidence: of a drift, too.
  void update(const PoseMeasurement& measured, bool is_evidence = true) noexcept;
  [[nodiscard]] const PoseTrajectory& likelier() const noexcept { return is_drifting_ ? drifting_ : constant_; }
  /// Logarithm of the likelihood ratio since the drift began, if there is one.
  [[nodiscard]] double evidence() const noexcept { return evidence_; }

 private:
  PoseTrajectory constant_, drifting_;
  double enough_, evidence_ = 0;
  bool is_drifting_ = false;
};

/// Variance of a rough calibration, per component.
[[nodiscard]] PoseMotion calibration_variances(const PoseCenter& center, double length_per_mm) noexcept;

/// The pose of a test, from frame to frame: constant unless the frames show a drift. Within a frame the
/// cloud is moved step by step to the most likely pose (iterated Kalman update).
class PoseFilter {
 public:
  /// duration_s: of a simulation. by_image, by_points: of DepthImages.
  PoseFilter(const PoseCenter& center, double length_per_mm, double duration_s, const PoseErrors& by_image,
             const std::optional<PoseErrors>& by_points = {}) noexcept;
  /// Another test begins.
  void reset() noexcept;
  /// The cloud of the next frame is moved by what the frames before say, even if a frame was refused half-way.
  void begin_frame(std::int64_t stamp_ns) noexcept;
  /// The motion that the cloud still lacks, by the frames before.
  [[nodiscard]] PoseBelief prior() const noexcept;
  [[nodiscard]] RigidTransform transform() const noexcept { return transform_of(moved_, center_); }
  /// The pose and its standard deviations.
  void write(FitNumbers& numbers) const noexcept;
  /// posterior: of the motion that the cloud still lacks. by_points: the same, measured by the points alone; used if
  /// the errors of such measurements are known. Moves the cloud by the mean. Returns whether that is so far that
  /// the frame should be matched again; at most `most_passes` times per frame, and once to go back. is_explained: a
  /// simulation fits the frame; others do not change the pose. time_s: that the frame shows, since the impact.
  /// hidden_residual: of what is seen, length unit, if something hides a part. What is seen then hardly tells some
  /// motions from shapes: when the residual increases, the cloud goes back to where it was least.
  bool move(const PoseBelief& posterior, bool is_explained = true, double time_s = 0,
            const std::optional<PoseMeasurement>& by_points = {}, std::optional<float> hidden_residual = {}) noexcept;
  /// Variance per component.
  [[nodiscard]] const PoseMotion& calibration() const noexcept { return calibration_; }
  [[nodiscard]] bool uses_points() const noexcept { return by_points_.has_value(); }
  /// Forgets what the frame has said so far, but not its poses, passes and residuals. before: the filter before the
  /// frame.
  void reconsider(const PoseFilter& before) noexcept;
  /// The frame has no points at this pose. Goes back to that of the frames before or, if it is that one, to none, which
  /// is kept if the frame is matched there. False when there is no other pose.
  bool retreat() noexcept;

 private:
  static constexpr std::uint32_t most_passes = 8;
  /// The whole motion, by the image and the points.
  [[nodiscard]] PoseMeasurement measured(const PoseBelief& posterior, double time_s,
                                         const std::optional<PoseMeasurement>& by_points) const noexcept;
  /// To the pose of the frames before, which the frame does not change. Returns whether the pose changed.
  bool go_back() noexcept;
  /// Whether the residual is clearly larger than the least one of the frame, whose pose it remembers.
  [[nodiscard]] bool is_worse(float residual) noexcept;

  PoseCenter center_;
  double tolerance_, noise_, duration_s_;  // noise_: of residuals, as in DepthMetric
  PoseSpreads spreads_;
  std::optional<PoseSpreads> by_points_;
  PoseMotion calibration_;  // variances
  DriftTest calibrated_;    // without any frame
  DriftTest test_;          // by the frames before, at the time of the frame
  PoseMotion moved_{};
  std::optional<std::int64_t> stamp_ns_;  // of the frame
  PoseMotion best_{};                     // of the frame: where its residual was least
  double least_squared_ = 0;              // this residual, squared
  std::uint32_t passes_ = 0;              // of the frame
  std::uint32_t unexplained_ = 0;         // frames in a row
  bool is_settled_ = false;               // the cloud is not moved any more
  bool is_frozen_ = false;                // the frame does not change the pose
  bool is_lost_ = false;                  // nor was that of the frames before right
};

}  // namespace lbea
