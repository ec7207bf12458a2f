// The motion of a test over time: constant or drifting, as estimated from one measurement per frame.
#pragma once

#include "runtime/src/depth/pose.hpp"

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
  void update(const PoseMeasurement& measured) noexcept;
  [[nodiscard]] const PoseTrajectory& likelier() const noexcept { return is_drifting_ ? drifting_ : constant_; }
  /// Logarithm of the likelihood ratio since the drift began, if there is one.
  [[nodiscard]] double evidence() const noexcept { return evidence_; }

 private:
  PoseTrajectory constant_, drifting_;
  double enough_, evidence_ = 0;
  bool is_drifting_ = false;
};

}  // namespace lbea
