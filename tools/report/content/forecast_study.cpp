#include "tools/report/content/forecast_study.hpp"

#include "runtime/src/depth/test_clock.hpp"
#include "tools/shared/matching/shapes.hpp"

#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::array shown_shares{0.1, 0.2, 0.5};  // of a simulation's duration: the first forecast from then on

double share_of(const Model& model, const wire::WireResult& result) {
  const double duration = EnsembleTimes::of(model.view()).duration_s;
  return duration > 0 ? double{result.fit.test_time} / duration : double{FrameRow::unknown};
}

std::vector<float> node_distances(std::span<const float> a, std::span<const float> b) {
  std::vector<float> distances;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3)
    distances.push_back(std::hypot(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]));
  return distances;
}

void compare(ForecastMoment& moment, std::span<const float> end,
             std::span<const std::array<std::uint32_t, 4>> elements) {
  const std::vector<float> distances = node_distances(moment.positions, end);
  double sum = 0;
  for (const float distance : distances) sum += double{distance};
  moment.distance = sum / static_cast<double>(distances.size());
  for (const auto& [a, b, c, d] : elements)
    moment.element_distances.push_back((distances[a] + distances[b] + distances[c] + distances[d]) / 4);
}

/// The estimate of the last frame that has one.
void find_end(ForecastStudy& study, const Model& model, const wire::WireResult& last) {
  const Leaders leaders = leaders_of(last);
  if (!is_shape_of(model, leaders.estimate)) return;
  study.end = positions_of(model, leaders.estimate);
  study.end_share = share_of(model, last);
}

void choose_shown(std::vector<ForecastMoment>& moments) {
  for (const double share : shown_shares) {
    const auto first =
        std::ranges::find_if(moments, [&](const ForecastMoment& moment) { return moment.share >= share; });
    if (first != moments.end()) first->is_shown = true;
  }
}

}  // namespace

std::vector<ChosenFrame> frames_with_forecasts(const RecordedTest& test) {
  return spread_over(test, FrameStudy::compared, [](const FrameRow& row) { return std::isfinite(row.final_error_90); });
}

ForecastStudy study_forecasts(const Model& model, std::span<const ChosenFrame> chosen,
                              const std::map<CaptureKey, RecordedFrame>& frames) {
  ForecastStudy study;
  for (const ChosenFrame& at : chosen) {
    const auto frame = frames.find(at.key);
    if (frame == frames.end() || !frame->second.result) continue;
    const wire::WireResult& result = *frame->second.result;
    find_end(study, model, result);
    ForecastMoment moment;
    moment.time_s = at.time_s;
    moment.share = share_of(model, result);
    moment.error_90 = double{result.forecast.error_90};
    moment.positions = final_positions_of(model, result.forecast);
    if (!moment.positions.empty()) study.moments.push_back(std::move(moment));
  }
  const auto elements = elements_of(model);
  if (study.is_compared())
    for (ForecastMoment& moment : study.moments) compare(moment, study.end, elements);
  choose_shown(study.moments);
  return study;
}

}  // namespace lbea::tool
