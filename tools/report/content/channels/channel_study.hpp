// The quantities of interest of a test beside those of the simulation that explains it, and how well they agree.
#pragma once

#include "tools/report/content/test_record.hpp"
#include "tools/shared/rating/objective_rating.hpp"
#include "tools/shared/rating/signal.hpp"

#include <functional>

namespace lbea::tool {

/// Times are since the impact; of the test since its first frame if the impact is not known.
struct StudiedChannel {
  Signal test;                            // the frames with a value
  Signal simulation;                      // its samples; empty: the model does not have the channel
  std::optional<ObjectiveRating> rating;  // of the simulation, where both have values; reference: the test
  std::string why_not;                    // a sentence without a rating
};

struct ChannelStudy {
  std::optional<std::uint32_t> simulation;  // the likeliest one of the test; of its last frame when the test has none
  std::optional<double> impact_s;           // since the test's first frame
  std::vector<StudiedChannel> channels;     // in the order of the record's

  [[nodiscard]] double since_impact(double time_s) const noexcept { return time_s - impact_s.value_or(0); }
};

/// The impact by the test's clock, of which the latest frame knows most; else the median over the frames that show a
/// state between the simulations' first and last. In seconds since the test's first frame.
[[nodiscard]] std::optional<double> impact_of(const Model& model, const TestRecord& record);

/// Fewer frames with a value while the simulation lasts are not rated, nor longer intervals.
inline constexpr std::size_t least_rated_frames = 10;
inline constexpr double longest_rated_s = 1;

/// Throws what `check`, called before each rating, throws.
[[nodiscard]] ChannelStudy study_channels(
    const Model& model, const TestRecord& record, const std::function<void()>& check = [] {});

}  // namespace lbea::tool
