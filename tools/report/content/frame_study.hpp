// Frames spread over a test, compared with the shapes that were found for them.
#pragma once

#include "tools/report/content/comparison/cloud_comparison.hpp"
#include "tools/report/content/recording_reader.hpp"

namespace lbea::tool {

/// A matched frame whose points and shapes are known.
struct StudiedFrame {
  double time_s = 0;  // since the test's first frame
  wire::WireResult result;
  std::vector<Point> points;                     // reference coordinates, thinned
  std::vector<float> match, estimate;            // nodes x 3; without method fit the same
  double match_time_s = 0, estimate_time_s = 0;  // in the simulations
  CloudComparison to_match, to_estimate;
  bool is_shown = false;                                               // one of the pictures' frames
  std::vector<std::uint32_t> match_eroded = {}, estimate_eroded = {};  // elements
};

struct FrameStudy {
  static constexpr std::size_t shown = 5, compared = 25;  // frames at most
  static_assert((compared - 1) % (shown - 1) == 0);       // so that the shown ones are among the compared ones
  std::vector<StudiedFrame> frames;                       // in the order of the test
  std::vector<std::array<std::uint32_t, 4>> elements;
  std::string missing;  // why there are fewer frames than the test has; a sentence, or empty
};

/// The frames to study: evenly spread over the matched ones, with the first and the last.
struct ChosenFrame {
  CaptureKey key;
  double time_s = 0;
  bool is_shown = false;
};
[[nodiscard]] std::vector<ChosenFrame> chosen_frames(const RecordedTest& test);
/// `count` of the frames that `has_what_it_needs`, evenly spread, with the first and the last.
[[nodiscard]] std::vector<ChosenFrame> spread_over(const RecordedTest& test, std::size_t count,
                                                   bool (*has_what_it_needs)(const FrameRow&));

/// `frames`: in reference coordinates. Frames without points, result, or shapes of the model are left out.
[[nodiscard]] FrameStudy study(const Model& model, std::span<const ChosenFrame> chosen,
                               std::map<CaptureKey, RecordedFrame> frames, const ReadingProgress& progress);

/// A part of the component, and how far the measured points on it are from the estimate, on average over the frames.
struct Region {
  Point center{};          // of its nodes in the initial state, reference coordinates
  std::uint32_t part = 0;  // the id of most of its elements
  double mean = 0;         // length unit
  double highest = 0;      // in the frame at `highest_time_s`
  double highest_time_s = 0;
};

struct RegionMap {
  std::vector<float> initial;            // nodes x 3: the initial state of the matched simulation
  std::vector<float> element_distances;  // mean over the frames; NaN: never measured
  std::vector<Region> worst;             // largest mean first
};

/// Divides the component into regions with the same number of elements. Empty without frames.
[[nodiscard]] RegionMap regions_of(const Model& model, const FrameStudy& study);

}  // namespace lbea::tool
