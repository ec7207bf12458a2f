// The states of a run at any moment, interpolated between the stored ones.
#pragma once

#include "precompute/simulation.hpp"

#include <array>

namespace lbea {

class StateSource {
 public:
  explicit StateSource(SimulationReader& reader) : reader_(reader) {}

  /// Positions and deletion flags at `state`, e.g. 3.25: positions linear in time between states 3 and 4, elements
  /// that state 3 still has. Valid until the next call. Fields are those of the earlier state.
  [[nodiscard]] const SimulationState& at(double state);

 private:
  const SimulationState& stored(std::uint32_t state);

  struct Slot {
    std::int64_t state = -1;
    SimulationState content;
  };
  SimulationReader& reader_;
  std::array<Slot, 2> slots_;  // a state lies in the slot of its parity
  SimulationState between_;
};

}  // namespace lbea
