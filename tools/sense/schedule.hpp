// The moments of a run that become frames, and the interpolated states at these moments.
#pragma once

#include "precompute/simulation.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

/// Steps of a stored run: an inclusive range with a stride.
struct StepRange {
  std::uint32_t first = 0;
  std::uint32_t last = std::numeric_limits<std::uint32_t>::max();  // default: the last state of the run
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
/// Throws as stored_frames() does, and when the rate results in more than 10 million frames.
[[nodiscard]] std::vector<FrameTime> resampled_frames(const std::vector<double>& state_times_s, const StepRange& steps,
                                                      double rate_hz, std::uint64_t max_frames);

/// The states of a run, interpolated between the stored ones.
class StateSource {
 public:
  explicit StateSource(bake::SimulationReader& reader) : reader_(reader) {}

  /// Positions are interpolated linearly between the stored states around `state` (3.25: between 3 and 4). Deletion
  /// flags and fields are those of the earlier state. Valid until the next call.
  [[nodiscard]] const bake::SimulationState& at(double state);

 private:
  const bake::SimulationState& stored(std::uint32_t state);

  struct Slot {
    std::int64_t state = -1;
    bake::SimulationState content;
  };
  bake::SimulationReader& reader_;
  std::array<Slot, 2> slots_;  // even states in slot 0, odd states in slot 1
  bake::SimulationState between_;
};

}  // namespace lbea::tool
