// Any bytes as ensemble.toml: refused in words, or a description that a bake can take.
#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/fuzz/memory_file.hpp"

#include <lbea/lbea.hpp>

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const lbea::fuzz::MemoryFile file;
  file.put({data, size});
  try {
    const lbea::EnsembleDescription description = lbea::read_ensemble_toml(file.path());
    if (description.runs.empty() || description.modes == 0 || !(description.time_factor > 0) || !(description.envelope_margin >= 0)) std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
