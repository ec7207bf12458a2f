#include "tools/report/content/frame_study.hpp"

#include "tools/shared/matching/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace lbea::tool {
namespace {

constexpr double reach_share = 0.1;  // of the component's size; points farther from it are not of the component

double size_of(std::span<const float> positions) {
  std::array<float, 3> low{positions[0], positions[1], positions[2]}, high = low;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], positions[i]);
    high[i % 3] = std::max(high[i % 3], positions[i]);
  }
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) largest = std::max(largest, double{high[k]} - double{low[k]});
  return largest;
}

/// `count` places of 0 to `size` - 1, evenly spread, with both ends.
std::set<std::size_t> spread(std::size_t size, std::size_t count) {
  std::set<std::size_t> places;
  for (std::size_t i = 0; i < count && size > 0; ++i)
    places.insert(static_cast<std::size_t>(
        std::llround(static_cast<double>(i) * static_cast<double>(size - 1) / static_cast<double>(count - 1))));
  return places;
}

std::optional<StudiedFrame> compared(const Model& model, const ChosenFrame& chosen, RecordedFrame frame,
                                     std::span<const std::array<std::uint32_t, 4>> elements) {
  if (!frame.result || frame.points.empty()) return std::nullopt;
  const Leaders leaders = leaders_of(*frame.result);
  if (!is_shape_of(model, leaders.match) || !is_shape_of(model, leaders.estimate)) return std::nullopt;
  std::vector<float> match = positions_of(model, leaders.match), estimate = positions_of(model, leaders.estimate);
  const double reach = reach_share * size_of(match);
  std::vector<std::uint32_t> match_eroded = eroded_in(model, leaders.match),
                             estimate_eroded = eroded_in(model, leaders.estimate);
  CloudComparison to_match(frame.points, match, without_eroded({elements.begin(), elements.end()}, match_eroded),
                           reach),
      to_estimate(frame.points, estimate, without_eroded({elements.begin(), elements.end()}, estimate_eroded), reach);
  return StudiedFrame{chosen.time_s,
                      std::move(*frame.result),
                      std::move(frame.points),
                      std::move(match),
                      std::move(estimate),
                      time_of(model, leaders.match),
                      time_of(model, leaders.estimate),
                      std::move(to_match),
                      std::move(to_estimate),
                      chosen.is_shown,
                      std::move(match_eroded),
                      std::move(estimate_eroded)};
}

}  // namespace

std::vector<ChosenFrame> spread_over(const RecordedTest& test, std::size_t count,
                                     bool (*has_what_it_needs)(const FrameRow&)) {
  std::vector<const FrameRow*> rows;
  for (const FrameRow& row : test.record.rows())
    if (has_what_it_needs(row)) rows.push_back(&row);
  std::vector<ChosenFrame> chosen;
  for (const std::size_t place : spread(rows.size(), count))
    chosen.push_back({{test.key.first, rows[place]->id}, rows[place]->time_s});
  return chosen;
}

std::vector<ChosenFrame> chosen_frames(const RecordedTest& test) {
  const auto is_matched = [](const FrameRow& row) { return row.is_matched() && std::isfinite(row.distance); };
  std::vector<ChosenFrame> chosen = spread_over(test, FrameStudy::compared, is_matched);
  for (const ChosenFrame& shown : spread_over(test, FrameStudy::shown, is_matched))
    std::ranges::find(chosen, shown.key, &ChosenFrame::key)->is_shown = true;
  return chosen;
}

FrameStudy study(const Model& model, std::span<const ChosenFrame> chosen, std::map<CaptureKey, RecordedFrame> frames,
                 const ReadingProgress& progress) {
  FrameStudy study;
  study.elements = elements_of(model);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    require_not_stopped();
    auto frame = compared(model, chosen[i], std::move(frames[chosen[i].key]), study.elements);
    if (frame) study.frames.push_back(std::move(*frame));
    if (progress) progress(i + 1, chosen.size());
  }
  if (study.frames.empty())
    study.missing = "The recording contains no frame of this test together with its result.";
  else if (study.frames.size() < chosen.size())
    study.missing = std::to_string(chosen.size() - study.frames.size()) + " of the " + std::to_string(chosen.size()) +
                    " frames chosen for pictures and regions are not in the recording.";
  return study;
}

}  // namespace lbea::tool
