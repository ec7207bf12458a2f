// Writes series.pvd with two states of a mesh with a quad and a triangle into the folder given.
#include "adapters/export/vtu.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path folder = argv[1];
  std::vector<float> positions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0.5f, 0.25f};
  const std::vector<std::uint32_t> nodes{0, 1, 2, 3, 1, 4, 2, 2};
  const std::vector<std::uint32_t> ids{11, 12, 13, 14, 4'000'000'000u}, parts{7, 8};
  const std::vector<float> strain{0.125f, 0.5f};
  std::vector<lbea::io::PvdEntry> entries;
  for (int state = 0; state < 2; ++state) {
    const std::filesystem::path file = folder / "states" / ("a&b" + std::to_string(state) + ".vtu");
    const double time_s = 0.0005 * state;
    positions[12] = 2 - static_cast<float>(state);
    lbea::io::write_vtu(file, {.positions = positions,
                               .element_nodes = nodes,
                               .point_arrays = {{"node_id", ids}, {"where <mm>", positions, 3}},
                               .cell_arrays = {{"plastic_strain", strain}, {"part", parts}},
                               .time_s = time_s});
    entries.push_back({time_s, file});
  }
  lbea::io::write_pvd(folder / "series.pvd", entries);
  lbea::io::write_vtu(folder / "empty.vtu", {});
  return 0;
}
