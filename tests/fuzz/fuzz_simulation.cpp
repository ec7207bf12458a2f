// Arbitrary bytes as the simulation file LBEA_FUZZ_FILE, beside the files of the folder LBEA_FUZZ_BESIDE, which it may
// name as its parts or belong to (LBEA_FUZZ_RUN, opened instead): an lbea::Error, or a run with consistent mesh and
// states.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include <lbea/lbea.hpp>

#include "adapters/simulation/open.hpp"
#include "tools/shared/system/scratch_folder.hpp"

#ifndef LBEA_FUZZ_RUN
#define LBEA_FUZZ_RUN LBEA_FUZZ_FILE
#endif

namespace {

/// Where the file is written: in memory if possible, because a disk would dominate the run time.
std::filesystem::path parent_folder() {
  const std::filesystem::path memory = "/dev/shm";
  return ::access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
}

/// The folder of the file and of those beside it.
struct RunFolder : lbea::tool::ScratchFolder {
  RunFolder() : ScratchFolder(parent_folder()) {
#ifdef LBEA_FUZZ_BESIDE
    std::filesystem::copy(LBEA_FUZZ_BESIDE, path());
#endif
  }
};

void require(bool condition) {
  if (!condition) std::abort();
}

void read_all(lbea::bake::SimulationReader& run) {
  const lbea::bake::SimulationMesh& mesh = run.mesh();
  require(mesh.positions.size() == 3 * mesh.nodes());
  require(mesh.element_ids.size() == mesh.elements.size() && mesh.element_parts.size() == mesh.elements.size());
  for (const auto& element : mesh.elements)
    for (const std::uint32_t node : element) require(node < mesh.nodes());
  std::size_t numbers = 0;
  for (const auto& history : run.histories()) numbers += history.size();
  lbea::bake::SimulationState state;
  for (std::uint32_t s = 0; s < run.states(); ++s) {
    run.read(s, state);
    require(state.positions.size() == mesh.positions.size() && state.alive.size() == mesh.elements.size());
    require(state.fields.size() == run.fields().size());
    for (const auto& field : state.fields) require(field.size() == mesh.elements.size());
    for (std::uint32_t place = 0; place < numbers; ++place) static_cast<void>(run.history(s, place));
  }
  for (std::uint32_t place = 0; place < numbers; ++place) {
    const lbea::bake::HistorySeries series = run.history_series(place);
    require(series.times.size() == series.values.size() && std::ranges::is_sorted(series.times));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const RunFolder folder;
  const std::filesystem::path file = folder.path() / LBEA_FUZZ_FILE;
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    read_all(*lbea::io::open_simulation(folder.path() / LBEA_FUZZ_RUN));
  } catch (const lbea::Error&) {
    // refused with a message
  }
  return 0;
}
