#include "adapters/simulation/d3plot/database.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::io::d3plot {
namespace {
using bake::SimulationHistory;

constexpr std::uint64_t time_words = 1, run_words = 6, part_words = 7;
constexpr double version_with_wall_positions = 971;

/// How many parts the global values have; 0: not known.
std::uint64_t parts_of(const Header& header) {
  if (header.parts != 0 && header.materials != 0 && header.parts != header.materials) return 0;
  const std::uint64_t parts = std::max(header.parts, header.materials);
  return header.globals >= plus(run_words, times(parts, part_words)) ? parts : 0;
}

/// The rest are the walls' forces and, in newer versions, three words of each one's position after all forces. Some
/// newer programs write an older version number: then only the walls count that there are in both cases.
std::uint64_t walls_of(const Header& header, std::uint64_t parts) {
  const std::uint64_t rest = header.globals - run_words - parts * part_words;
  constexpr std::uint64_t wall_words = 4;
  if (rest % wall_words == 0) return rest / wall_words;
  return header.version < version_with_wall_positions ? rest : 0;
}

/// Its numbers are `stride` words apart.
void add(StoredHistories& stored, SimulationHistory history, std::uint64_t word, std::uint64_t stride = 1) {
  for (std::uint64_t i = 0; i < history.size(); ++i) stored.words.push_back(word + i * stride);
  stored.histories.push_back(std::move(history));
}

std::vector<std::uint32_t> from_one(std::uint64_t count) {
  std::vector<std::uint32_t> ids(count);
  std::iota(ids.begin(), ids.end(), 1u);
  return ids;
}
}  // namespace

// The run's six values, then those of all parts: internal energies, kinetic energies, velocities (x, y, z of each
// part), masses, hourglass energies; then the rigid walls.
StoredHistories stored_histories(const Header& header, const std::vector<std::uint32_t>& part_ids) {
  StoredHistories stored;
  if (header.globals < run_words) return stored;
  std::uint64_t word = time_words;
  for (const char* name :
       {"kinetic_energy", "internal_energy", "total_energy", "velocity_x", "velocity_y", "velocity_z"})
    add(stored, {name}, word++);
  const std::uint64_t parts = parts_of(header);
  if (parts == 0) return stored;
  const std::vector<std::uint32_t> ids = part_ids.size() == parts ? part_ids : from_one(parts);
  const auto add_parts = [&](const char* name, std::uint64_t start, std::uint64_t stride) {
    add(stored, {name, HistoryOwner::part, ids}, word + start, stride);
  };
  add_parts("part_internal_energy", 0, 1);
  add_parts("part_kinetic_energy", parts, 1);
  add_parts("part_velocity_x", 2 * parts, 3);
  add_parts("part_velocity_y", 2 * parts + 1, 3);
  add_parts("part_velocity_z", 2 * parts + 2, 3);
  add_parts("part_mass", 5 * parts, 1);
  add_parts("part_hourglass_energy", 6 * parts, 1);
  if (const std::uint64_t walls = walls_of(header, parts); walls > 0)
    add(stored, {"rigid_wall_force", HistoryOwner::wall, from_one(walls)}, word + part_words * parts);
  return stored;
}
}  // namespace lbea::io::d3plot
