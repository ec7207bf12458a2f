// The pose error of a test: the rigid motion that T_reference_sensor lacks, as estimated from the frames so far.
#pragma once

#include "runtime/src/depth/pose_trajectory.hpp"
#include "runtime/src/depth/test_clock.hpp"

#include <optional>

namespace lbea {

/// Variance of a rough calibration, per component.
[[nodiscard]] PoseMotion calibration_variances(const PoseCenter& center, double length_per_mm) noexcept;

/// The pose of a test, from frame to frame: constant unless the frames show a drift. Within a frame the
/// cloud is moved step by step to the most likely pose (iterated Kalman update).
class PoseFilter {
 public:
  /// duration_s: of a simulation. drift_evidence: of DepthImages.
  PoseFilter(const PoseCenter& center, double length_per_mm, double duration_s, double drift_evidence) noexcept;
  /// Another test begins.
  void reset() noexcept;
  /// The cloud of the next frame is moved by what the frames before say, even if a frame was refused half-way.
  void begin_frame(std::int64_t stamp_ns) noexcept;
  /// The motion that the cloud still lacks, by the frames before.
  [[nodiscard]] PoseBelief prior() const noexcept;
  [[nodiscard]] RigidTransform transform() const noexcept { return transform_of(moved_, center_); }
  /// The pose and its standard deviations.
  void write(FitNumbers& numbers) const noexcept;
  /// posterior: of the motion that the cloud still lacks. Moves it by the mean. Returns whether that is so far that
  /// the frame should be matched again; at most `most_passes` times per frame, and once to go back. is_explained: a
  /// simulation fits the frame; others do not change the pose.
  bool move(const PoseBelief& posterior, bool is_explained = true) noexcept;
  /// The frame has no points at this pose. Goes back to that of the frames before or, if it is that one, to none, which
  /// is kept if the frame is matched there. False when there is no other pose.
  bool retreat() noexcept;

 private:
  static constexpr std::uint32_t most_passes = 8;
  /// To the pose of the frames before, which the frame does not change. Returns whether the pose changed.
  bool go_back() noexcept;

  PoseCenter center_;
  double tolerance_, duration_s_;
  PoseMotion calibration_;  // variances
  DriftTest calibrated_;    // without any frame
  DriftTest test_;          // by the frames before, at the time of the frame
  PoseMotion moved_{};
  std::optional<std::int64_t> stamp_ns_;  // of the frame
  std::uint32_t passes_ = 0;              // of the frame
  std::uint32_t unexplained_ = 0;         // frames in a row
  bool is_frozen_ = false;                // the frame does not change the pose
  bool is_lost_ = false;                  // nor was that of the frames before right
};

}  // namespace lbea
