#include "tools/sense/schedule.hpp"

#include "tools/shared/text/formatted.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr double most_frames = 1e7;
constexpr double rounding = 1e-6;  // share of a frame interval by which the last frame may miss the last state

/// The range with its last step resolved. Throws when the run does not have all of it.
StepRange within(std::size_t states, StepRange steps) {
  if (states == 0) throw Error{Status::bad_config, "the run has no stored states"};
  const auto final_state = static_cast<std::uint32_t>(states - 1);
  const bool open_end = steps.last == StepRange{}.last;
  if (open_end) steps.last = final_state;
  if (steps.last > final_state)
    throw Error{Status::bad_config, "--steps asks for state " + std::to_string(steps.last) +
                                        ", but the last state of the run is " + std::to_string(final_state)};
  return steps;
}

FrameTime between_states(const std::vector<double>& times, double time_s) {
  const auto after = std::upper_bound(times.begin(), times.end(), time_s);
  if (after == times.begin()) return {0, time_s};
  const auto before = after - 1;
  const auto index = static_cast<double>(before - times.begin());
  if (after == times.end()) return {index, time_s};
  return {index + (time_s - *before) / (*after - *before), time_s};
}

}  // namespace

std::optional<StepRange> parse_steps(const std::string& text) {
  if (text == "all") return StepRange{};
  const auto numbers = parsed_list<std::uint32_t>(text, ':');
  if (!numbers || numbers->size() > 3) return std::nullopt;
  StepRange steps{numbers->front(), numbers->front(), 1};
  if (numbers->size() > 1) steps.last = (*numbers)[1];
  if (numbers->size() > 2) steps.stride = (*numbers)[2];
  return steps.first <= steps.last && steps.stride > 0 ? std::optional(steps) : std::nullopt;
}

std::vector<FrameTime> stored_frames(const std::vector<double>& state_times_s, const StepRange& wanted) {
  const StepRange steps = within(state_times_s.size(), wanted);
  std::vector<FrameTime> frames;
  for (std::uint64_t state = steps.first; state <= steps.last; state += steps.stride)
    frames.push_back({static_cast<double>(state), state_times_s[state]});
  return frames;
}

std::vector<FrameTime> resampled_frames(const std::vector<double>& state_times_s, const StepRange& wanted,
                                        double rate_hz, std::uint64_t max_frames) {
  const StepRange steps = within(state_times_s.size(), wanted);
  const double begin = state_times_s[steps.first], end = state_times_s[steps.last];
  const double intervals = std::min(std::floor((end - begin) * rate_hz + rounding), static_cast<double>(max_frames));
  if (!(intervals >= 0 && intervals < most_frames))
    throw Error{Status::bad_config, "--rate " + std::to_string(rate_hz) + " over " + std::to_string(end - begin) +
                                        " s makes too many frames; take a lower rate or --frames"};
  const std::uint64_t count = std::min(static_cast<std::uint64_t>(intervals) + 1, max_frames);
  std::vector<FrameTime> frames;
  for (std::uint64_t frame = 0; frame < count; ++frame)
    frames.push_back(between_states(state_times_s, std::min(begin + static_cast<double>(frame) / rate_hz, end)));
  return frames;
}

const bake::SimulationState& StateSource::stored(std::uint32_t state) {
  Slot& slot = slots_[state % 2];
  if (slot.state != state) {
    slot.state = -1;  // invalid if the read throws
    reader_.read(state, slot.content);
    slot.state = state;
  }
  return slot.content;
}

const bake::SimulationState& StateSource::at(double state) {
  const double whole = std::floor(state);
  const auto index = static_cast<std::uint32_t>(whole);
  const bake::SimulationState& before = stored(index);
  const double share = state - whole;
  if (share <= 0) return before;
  const bake::SimulationState& after = stored(index + 1);
  between_ = before;
  between_.time_s = std::lerp(before.time_s, after.time_s, share);
  for (std::size_t i = 0; i < between_.positions.size(); ++i)
    between_.positions[i] = std::lerp(before.positions[i], after.positions[i], static_cast<float>(share));
  return between_;
}

}  // namespace lbea::tool
