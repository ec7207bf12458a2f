// Histories: numbers per state that a solver writes besides the mesh, like energies.
#pragma once

#include <cstdint>
#include <string>

namespace lbea {

enum class HistoryOwner : std::uint32_t { run, part, wall };
inline constexpr std::uint32_t history_owners = 3;

struct SolverHistory {
  std::string name;  // e.g. "internal_energy", "part_mass", "rigid_wall_force"
  HistoryOwner owner = HistoryOwner::run;
  std::uint32_t number = 0;  // of the part or rigid wall, the solver's; of the run: 0

  /// "internal_energy", "part_mass of part 5", "rigid_wall_force of wall 1".
  [[nodiscard]] std::string text() const {
    if (owner == HistoryOwner::run) return name;
    return name + (owner == HistoryOwner::part ? " of part " : " of wall ") + std::to_string(number);
  }
};

}  // namespace lbea
