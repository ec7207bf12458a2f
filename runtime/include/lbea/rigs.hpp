// rigs.hpp - one answer from several rigs that see the same component from different sides.
//
// Each rig's frame is matched alone, with the rig's own pose error and hidden parts. The frames of one capture are then
// fitted together: the squares of all rigs' depth images are added up, so that each rig determines what it shows.
#pragma once

#include <lbea/lbea.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

struct Rig {
  RigidTransform T_reference_sensor = identity_transform;
  SensorViews views{};               // rendered for this pose; empty: those baked into the model for the nearest pose
  std::int64_t clock_offset_ns = 0;  // added to the stamps of its frames, it gives those of a common clock
};

/// What a rig's frame says alone. If it is used, the pose's numbers and the coverage are by the estimate of all rigs.
struct RigResult : FitNumbers, FrameNumbers {
  Status status = Status::empty_frame;  // also if the rig has no frame in the capture
  Verdict verdict = Verdict::unknown;
  PointTally points{};
  bool is_used = false;  // the joint result rests on it
  /// Added to the rig's stamps beside Rig::clock_offset_ns, it gives those of the first rig's clock, by the impact that
  /// both have seen in this test, then by the shapes that both show until half of a simulation has passed. 0 until the
  /// impact, and for clocks that differ by less than the interval between states or by more than a simulation lasts.
  std::int64_t clock_correction_ns = 0;
};

/// Threads of the caller that share the work of a capture.
struct RigThreads {
  /// Calls part(work, i) for each i < parts, at the same time on any threads, and returns when all have returned and
  /// the caller sees what they wrote. It must not throw: what it throws ends the process.
  void (*run)(void* threads, std::size_t parts, void (*part)(const void* work, std::size_t i),
              const void* work) = nullptr;
  void* threads = nullptr;
};

/// One per test stand. Owns all scratch memory and what the frames of the test have shown so far; see
/// lbea/test_history.hpp. Method::fit alone.
class LBEA_API RigMatcher {
 public:
  /// `config`: its pose and method are not used. Throws Error{bad_config} with the offending rig and value.
  RigMatcher(Model model, const MatcherConfig& config, const std::vector<Rig>& rigs);
  ~RigMatcher();
  RigMatcher(RigMatcher&&) noexcept;
  RigMatcher& operator=(RigMatcher&&) noexcept;

  /// frames: one per rig, in their order, captured at nearly the same time: those more than a tenth of a simulation's
  /// duration older than the latest one are not used. Without points: the rig has none. The result is for the time of
  /// the first frame that it rests on. Frames that no simulation explains count only if no explained one shows nearly
  /// as much. If one that does not count shows half of the component, or the rigs see different shapes, the verdict is
  /// unknown and no error is bounded.
  /// The limits and bounds are those that the bakes have learned for single rigs. coverage: the share of
  /// the surface that any rig in use shows; the pose's numbers are those of rigs(). Real-time safe.
  [[nodiscard]] MatchResult match(std::span<const Frame> frames) noexcept;
  /// The same in two steps: the first one for each rig with a frame, which different threads may do at the same time;
  /// then the second. Points must remain valid until then. Of several frames of a rig, the last one counts.
  void match_alone(std::size_t rig, const Frame& frame) noexcept;
  [[nodiscard]] MatchResult combine() noexcept;
  /// Of the last capture.
  [[nodiscard]] std::span<const RigResult> rigs() const noexcept;

  /// combine() gives each of these threads, which must remain, the work of some rigs; the results are the same. Call it
  /// between captures.
  void use_threads(const RigThreads& threads) noexcept;
  /// The poses are exact: their errors are neither estimated nor corrected. Call it between captures.
  void fix_poses() noexcept;
  /// The stamp of the impact, by the clock that the offsets lead to, is known, also for later tests.
  void set_impact(std::int64_t stamp_ns) noexcept;
  /// The motion that corrects a rig's frames, in reference coordinates, after T_reference_sensor.
  [[nodiscard]] RigidTransform pose_correction(std::size_t rig) const noexcept;
  /// The next capture is the first of another test.
  void reset() noexcept;

  [[nodiscard]] const Model& model() const noexcept;

 private:
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea
