// Arbitrary bytes as ensemble.toml: refused with a message, or a description that can be baked.
#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/fuzz/memory_file.hpp"

#include <lbea/lbea.hpp>

#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Patterns of folders such as ".?" would search the whole file system; patterns of names in a folder are tested.
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto pattern = text.find_first_of("*?[\\");
  if (pattern != text.npos && (text.find('/', pattern) != text.npos || text.find("..") != text.npos ||
                               text.find("\"/") != text.npos || text.find("'/") != text.npos))
    return 0;
  static const lbea::fuzz::MemoryFile file;
  file.put({data, size});
  try {
    const lbea::bake::EnsembleDescription description = lbea::io::read_ensemble_toml(file.path());
    if (description.runs.empty() || description.modes == 0 || !(description.time_factor > 0) ||
        !(description.margin() >= 0))
      std::abort();
  } catch (const lbea::Error& error) {
    if (error.what()[0] == '\0') std::abort();
  }
  return 0;
}
