// The pose error of a test: the small rigid motion that T_reference_sensor lacks, as estimated from the frames so far.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <lbea/pose.hpp>

namespace lbea {

/// A small rigid motion as six lengths: the turn about the component's middle times its arm, then the shift; reference
/// coordinates.
using PoseMotion = std::array<double, 6>;
/// Symmetric, row by row.
using PoseMatrix = std::array<double, 36>;

/// Of the component: its middle, and the root mean square distance of its nodes from it.
struct PoseCenter {
  std::array<double, 3> middle{};
  double arm = 1;
  /// Of the first sample's nodes.
  [[nodiscard]] static PoseCenter of(const ModelView& model);
};

[[nodiscard]] RigidTransform transform_of(const PoseMotion& motion, const PoseCenter& center) noexcept;
/// a b.
[[nodiscard]] RigidTransform product(const RigidTransform& a, const RigidTransform& b) noexcept;

/// L L' = matrix, which is positive semi-definite.
class PoseFactor {
 public:
  explicit PoseFactor(const PoseMatrix& matrix) noexcept;
  /// L^-1 b.
  [[nodiscard]] PoseMotion forward(PoseMotion b) const noexcept;
  /// L'^-1 b.
  [[nodiscard]] PoseMotion backward(PoseMotion b) const noexcept;
  [[nodiscard]] double operator()(std::size_t row, std::size_t column) const noexcept {
    return lower_[6 * row + column];
  }

 private:
  PoseMatrix lower_{};
};

/// A normal distribution of the motion.
struct PoseBelief {
  PoseMotion mean{};
  PoseMatrix information{};  // inverse covariance
};

/// The pose of a test, from frame to frame: a Kalman filter of a motion that stays the same. Within a frame the cloud
/// is moved step by step to the most likely pose (iterated Kalman update).
class PoseFilter {
 public:
  PoseFilter(const PoseCenter& center, double length_per_mm) noexcept;
  /// Another test begins.
  void reset() noexcept;
  /// The cloud of the next frame is moved by what the frames before say, even if a frame was refused half-way.
  void begin_frame() noexcept;
  /// The motion that the cloud still lacks, by the frames before.
  [[nodiscard]] PoseBelief prior() const noexcept;
  [[nodiscard]] RigidTransform transform() const noexcept { return transform_of(moved_, center_); }
  [[nodiscard]] float turn_deg() const noexcept;
  [[nodiscard]] float shift() const noexcept;
  /// posterior: of the motion that the cloud still lacks. Moves it by the mean. Whether that is so far that the frame
  /// should be matched again; at most `most_passes` times per frame.
  bool move(const PoseBelief& posterior) noexcept;
  /// This pose cannot be right. Goes back to that of the frames before or, if it is that one, to none; there the frame
  /// does not move the cloud any more. False when there is no other pose.
  bool retreat() noexcept;

 private:
  static constexpr std::uint32_t most_passes = 8;
  PoseCenter center_;
  double tolerance_;
  PoseMatrix calibration_{};
  PoseBelief belief_;  // by the frames before
  PoseMotion moved_{};
  std::uint32_t passes_ = 0;  // of the current frame
  bool is_frozen_ = false;
};

struct TestPose::State {
  PoseFilter filter;
  bool is_estimated;
};

}  // namespace lbea
