// Runs a fuzz target without libFuzzer, so that ordinary and sanitizer builds test it: every corpus file unchanged,
// then seeded mutations of each. `fuzz_x FILE` replays one input.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Bytes mutate(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  for (std::size_t edits = 1 + below(4); edits > 0 && !bytes.empty(); --edits) {
    const std::size_t at = below(bytes.size());
    switch (below(5)) {
      case 0:
        bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << below(8)));
        break;
      case 1:
        bytes[at] = static_cast<std::uint8_t>(below(256));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes[below(bytes.size())]);
        break;
      default:  // a 32-bit word set to a value that often causes overflow
        for (std::size_t i = at & ~std::size_t{3}, end = std::min(bytes.size(), i + 4); i < end; ++i)
          bytes[i] = below(2) ? 0xff : 0x7f;
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t runs = 0;
  std::mt19937 random(20221);
  const std::size_t mutations_per_input = 200;
  for (int i = 1; i < argc; ++i) {
    std::vector<std::filesystem::path> files;
    if (std::filesystem::is_directory(argv[i]))
      for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
        if (entry.is_regular_file()) files.push_back(entry.path());
      }
    else
      files.emplace_back(argv[i]);
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
      const Bytes input = read(file);
      LLVMFuzzerTestOneInput(input.data(), input.size());
      ++runs;
      if (files.size() == 1) continue;
      for (std::size_t m = 0; m < mutations_per_input; ++m, ++runs) {
        const Bytes mutated = mutate(input, random);
        LLVMFuzzerTestOneInput(mutated.data(), mutated.size());
      }
    }
  }
  std::printf("%zu inputs, no finding\n", runs);
  return runs > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
