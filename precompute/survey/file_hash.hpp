// The identity of an input file, for the model's provenance.
#pragma once

#include <cstdint>
#include <filesystem>

namespace lbea::bake {

struct FileHash {
  std::uint64_t size = 0;  // bytes
  std::uint64_t hash = 0;  // XXH3-64
};

/// Reads the file piece by piece. Throws Error{bad_input} naming it.
[[nodiscard]] FileHash hash_file(const std::filesystem::path& path);

}  // namespace lbea::bake
