// An open d3plot database: control words, geometry, layout of a state, and the place of each state in the files.
#pragma once

#include "adapters/simulation/d3plot/geometry.hpp"
#include "adapters/simulation/d3plot/state_layout.hpp"
#include "adapters/simulation/d3plot/words.hpp"

namespace lbea::io::d3plot {

struct StatePlace {
  std::uint32_t file = 0;  // index in the family
  std::uint64_t word = 0;
  double time_s = 0;
};

struct Database {
  Header header;
  Geometry geometry;
  StateLayout layout;
  std::uint64_t word_bytes = 4;
  std::vector<std::filesystem::path> family;
  std::vector<StatePlace> states;
};

/// Throws Error{file_not_found | bad_input | unsupported_input}.
[[nodiscard]] Database open_database(const std::filesystem::path& first_file);

/// Reads the states of an open database, keeping one file open.
class StateFile {
 public:
  explicit StateFile(const Database& database);
  /// Reads `into.size()` words of the state at `place`, from word `start` of the state.
  void read(const StatePlace& place, std::uint64_t start, std::span<float> into);

 private:
  std::vector<std::filesystem::path> family_;
  std::uint64_t word_bytes_;
  std::uint32_t open_ = 0;
  std::optional<WordFile> file_;
};

}  // namespace lbea::io::d3plot
