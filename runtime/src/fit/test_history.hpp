// What a TestHistory keeps.
#pragma once

#include "runtime/src/fit/surface_fit.hpp"
#include "runtime/src/pose/pose_filter.hpp"

#include <lbea/test_history.hpp>

namespace lbea {

/// The shape that a frame shows. error_90: of the estimate; NaN: not known.
[[nodiscard]] EarlierShape shape_shown(std::int64_t stamp_ns, const ShapeEstimate& estimate, float error_90,
                                       float spread) noexcept;

struct LBEA_HIDDEN HistoryState {
  HistoryState(const ModelView& model, double length_per_mm, const DepthImages* images);

  /// Whether the frames of a matcher may use it: it keeps numbers of samples, and cells. cells: of the matcher's depth
  /// image.
  [[nodiscard]] bool fits(const ModelView& model, std::size_t cells) const noexcept {
    return model.file_checksum == model_checksum && cells == hidden.cells();
  }
  void reset() noexcept;
  void begin_frame(std::int64_t stamp_ns) noexcept;
  /// Of the frame.
  [[nodiscard]] FrameExpectation expectation() const noexcept;
  /// The frame was fitted: keeps when the test began and, if a simulation explains the frame, what is hidden of it.
  void see(SurfaceFitter& fitter) noexcept;
  /// Keeps when the test began, by a frame of several rigs.
  void begin(std::int64_t at_ns, double earliest_s) noexcept { clock.begin(at_ns, earliest_s); }
  /// What a frame that a simulation explains shows is evidence for later ones. time: of the samples, in theirs.
  void add(const EarlierShape& shape, const TimeBelief& time) noexcept;
  /// The same of the time of the frame alone.
  void add_time(const TimeBelief& time) noexcept;
  /// At the frame.
  [[nodiscard]] TimeBelief since_impact() const noexcept { return clock.since_impact(stamp_ns); }
  /// The time since the impact, at a stamp.
  void write_time(std::int64_t at_ns, FitNumbers& numbers) const noexcept;

  std::uint64_t model_checksum;
  bool estimates_pose;
  PoseFilter pose;
  ShapeHistory shapes;
  HiddenCells hidden;
  double impact_s;  // in the time of the samples
  TestClock clock;
  std::int64_t stamp_ns = 0;  // of the frame
};

}  // namespace lbea
