// Arbitrary bytes as the simulation file LBEA_FUZZ_FILE: an lbea::Error, or a run with consistent mesh and states.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include <lbea/lbea.hpp>

#include "adapters/simulation/open.hpp"

namespace {

/// A folder for the file, removed at exit. In memory if possible, because a disk would dominate the run time.
class Folder {
 public:
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    const auto parent = ::access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
    std::string name = (parent / "lbea-fuzz-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::filesystem::path file() const { return path_ / LBEA_FUZZ_FILE; }

 private:
  std::filesystem::path path_;
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
  lbea::bake::SimulationState state;
  for (std::uint32_t s = 0; s < run.states(); ++s) {
    run.read(s, state);
    require(state.positions.size() == mesh.positions.size() && state.alive.size() == mesh.elements.size());
    require(state.fields.size() == run.fields().size());
    for (const auto& field : state.fields) require(field.size() == mesh.elements.size());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  std::ofstream(folder.file(), std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    read_all(*lbea::io::open_simulation(folder.file()));
  } catch (const lbea::Error&) {
    // refused with a message
  }
  return 0;
}
