#include "tools/sense/state_source.hpp"

#include <cmath>

namespace lbea::tool {

const bake::SimulationState& StateSource::stored(std::uint32_t state) {
  Slot& slot = slots_[state % 2];
  if (slot.state != state) {
    slot.state = -1;  // a read that throws leaves nothing that looks valid
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
