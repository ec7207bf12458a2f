// What the frames forecast of the test's end, beside what came.
#pragma once

#include "tools/report/content/frame_study.hpp"

namespace lbea::tool {

/// The final shape that a frame's result forecasts.
struct ForecastMoment {
  double time_s = 0;             // of the frame, since the test's first one
  double share = 0;              // of a simulation's duration that had been seen
  double error_90 = 0;           // of the forecast, length unit
  std::vector<float> positions;  // nodes x 3
  double distance =
      static_cast<double>(FrameRow::unknown);  // mean over the nodes from the estimate at the end; NaN: not compared
  std::vector<float> element_distances;        // the same over the corners of each element
  bool is_shown = false;                       // in a picture
};

struct ForecastStudy {
  std::vector<ForecastMoment> moments;  // in the order of the test
  std::vector<float> end;               // the estimate of the last frame, nodes x 3; empty: unknown
  double end_share = 0;                 // of a simulation's duration that the test shows
  /// Forecasts are of the simulations' last states: frames until then have to have been recorded.
  [[nodiscard]] bool is_compared() const noexcept { return !end.empty() && end_share >= whole; }
  static constexpr double whole = 0.95;
};

/// Frames with forecasts, evenly spread, with the last.
[[nodiscard]] std::vector<ChosenFrame> frames_with_forecasts(const RecordedTest& test);

/// `frames`: of one test, with their results.
[[nodiscard]] ForecastStudy study_forecasts(const Model& model, std::span<const ChosenFrame> chosen,
                                            const std::map<CaptureKey, RecordedFrame>& frames);

}  // namespace lbea::tool
