// pose.hpp - the pose error of a test, estimated from its frames.
//
// T_reference_sensor is never exact, and each millimeter of pose error would count as deformation. With fit, the error
// is a rigid motion that is the same in all frames of a test, or drifts, by their stamps; frames that show a nearly
// undeformed component determine it best.
#pragma once

#include <lbea/lbea.hpp>

#include <memory>

namespace lbea {

/// One per test; give it to Matcher::match() with each frame, in their order.
class LBEA_API TestPose {
 public:
  /// `views`: the matcher's; when empty, those baked into the model.
  explicit TestPose(const Model& model, const SensorViews& views = {});
  ~TestPose();
  TestPose(TestPose&&) noexcept;
  TestPose& operator=(TestPose&&) noexcept;

  /// Whether the model supports the estimate: it has depth images, and the bake has learned how certain they are.
  [[nodiscard]] bool is_estimated() const noexcept;
  /// The motion that corrects the frames, in reference coordinates, after T_reference_sensor.
  [[nodiscard]] RigidTransform correction() const noexcept;
  /// Starts another test with the next frame.
  void reset() noexcept;

 private:
  friend class Matcher;
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea
