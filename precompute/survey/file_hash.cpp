#include "precompute/survey/file_hash.hpp"

#include "runtime/src/model/checksum.hpp"

#include <lbea/lbea.hpp>

#include <fstream>
#include <memory>
#include <new>
#include <vector>

namespace lbea::bake {

FileHash hash_file(const std::filesystem::path& path) {
  constexpr std::size_t piece = std::size_t{1} << 20;
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  if (state == nullptr) throw std::bad_alloc();
  XXH3_64bits_reset(state.get());
  std::ifstream file(path, std::ios::binary);
  std::vector<char> buffer(piece);
  FileHash result;
  while (file) {
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    const auto got = static_cast<std::size_t>(file.gcount());
    XXH3_64bits_update(state.get(), buffer.data(), got);
    result.size += got;
  }
  if (!file.eof()) throw Error(Status::bad_input, "cannot read " + path.string() + "; check the file and its rights");
  result.hash = XXH3_64bits_digest(state.get());
  return result;
}

}  // namespace lbea::bake
