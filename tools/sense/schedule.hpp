// Which moments of a run become frames.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

/// Steps of a stored run: an inclusive range with a stride.
struct StepRange {
  std::uint32_t first = 0;
  std::uint32_t last = std::numeric_limits<std::uint32_t>::max();  // the run's last state, if it has fewer
  std::uint32_t stride = 1;
};

/// "all", "7", "2:30" or "2:30:4", both ends included; nothing for any other text.
[[nodiscard]] std::optional<StepRange> parse_steps(const std::string& text);

/// A moment between two stored states: `state` 3.25 is a quarter of the way from state 3 to state 4.
struct FrameTime {
  double state;
  double time_s;
};

/// The stored states of `steps`.
/// Throws Error{bad_config} when a range that is not "all" goes beyond the run, or the run has no states.
[[nodiscard]] std::vector<FrameTime> stored_frames(const std::vector<double>& state_times_s, const StepRange& steps);

/// Moments 1/rate_hz apart from the first to the last state of `steps`, at most `max_frames` of them.
/// Throws as stored_frames does, and for a rate that makes an absurd number of frames.
[[nodiscard]] std::vector<FrameTime> resampled_frames(const std::vector<double>& state_times_s, const StepRange& steps,
                                                      double rate_hz, std::uint64_t max_frames);

}  // namespace lbea::tool
