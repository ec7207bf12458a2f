// The states of a run at any moment, interpolated between the stored ones.
#pragma once

#include "precompute/simulation.hpp"

#include <array>

namespace lbea::tool {

class StateSource {
 public:
  explicit StateSource(bake::SimulationReader& reader) : reader_(reader) {}

  /// Positions and deletion flags at `state`, e.g. 3.25: positions linear in time between states 3 and 4, elements
  /// that state 3 still has. Valid until the next call. Fields are those of the earlier state.
  [[nodiscard]] const bake::SimulationState& at(double state);

 private:
  const bake::SimulationState& stored(std::uint32_t state);

  struct Slot {
    std::int64_t state = -1;
    bake::SimulationState content;
  };
  bake::SimulationReader& reader_;
  std::array<Slot, 2> slots_;  // a state lies in the slot of its parity
  bake::SimulationState between_;
};

}  // namespace lbea::tool
