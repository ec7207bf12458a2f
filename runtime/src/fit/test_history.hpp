// What a TestHistory keeps.
#pragma once

#include "runtime/src/fit/pose_filter.hpp"
#include "runtime/src/fit/surface_fit.hpp"

#include <lbea/test_history.hpp>

namespace lbea {

struct LBEA_HIDDEN HistoryState {
  HistoryState(const ModelView& model, double length_per_mm, const DepthImages* images);

  void reset() noexcept;
  void begin_frame(std::int64_t stamp_ns) noexcept;
  /// Of the frame.
  [[nodiscard]] FrameExpectation expectation() const noexcept;
  /// The frame was fitted: if enough of it is covered and a simulation explains it, it is evidence for later ones.
  void add(SurfaceFitter& fitter, MatchResult& result) noexcept;

  bool estimates_pose;
  PoseFilter pose;
  ShapeHistory shapes;
  HiddenCells hidden;
  double impact_s;  // in the time of the samples
  TestClock clock;
  std::int64_t stamp_ns = 0;  // of the frame
};

}  // namespace lbea
