// test_history.hpp - what the frames of a test have shown so far, for the next one.
//
// Pose error: T_reference_sensor is never exact, and each millimeter of pose error would count as deformation. The
// error is a rigid motion that is the same in all frames of a test, or drifts; frames that show a nearly undeformed
// component determine it best.
// Shape: a component deforms as some simulation does from an earlier shape, so that a part that is hidden now is known
// from a frame that showed it.
// Clock: the stamps tell the time since the impact, once some frames have shown a deformation.
#pragma once

#include <lbea/lbea.hpp>

#include <memory>

namespace lbea {

/// One per test; give it to Matcher::match() with each frame, in their order, with their stamps. Only Method::fit uses
/// it.
class LBEA_API TestHistory {
 public:
  /// `views`: the matcher's; when empty, those baked into the model. A matcher of another model, or with images of
  /// another size, does not use the history.
  explicit TestHistory(const Model& model, const SensorViews& views = {});
  ~TestHistory();
  TestHistory(TestHistory&&) noexcept;
  TestHistory& operator=(TestHistory&&) noexcept;

  /// T_reference_sensor is exact: the pose error is neither estimated nor corrected.
  void fix_pose() noexcept;
  /// The impact's stamp is known, also for later tests: it is not estimated.
  void set_impact(std::int64_t stamp_ns) noexcept;
  /// Whether the pose error is estimated: the model has depth images, the bake has learned how certain they are, and
  /// the pose is not fixed.
  [[nodiscard]] bool estimates_pose() const noexcept;
  /// The motion that corrects the frames, in reference coordinates, after T_reference_sensor.
  [[nodiscard]] RigidTransform pose_correction() const noexcept;
  /// Starts another test with the next frame.
  void reset() noexcept;

 private:
  friend class Matcher;
  std::unique_ptr<HistoryState> state_;
};

}  // namespace lbea
