// The files of a database and where each state begins in them.
#pragma once

#include "adapters/simulation/d3plot/geometry.hpp"
#include "adapters/simulation/d3plot/state_layout.hpp"
#include "adapters/simulation/d3plot/words.hpp"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace lbea::io::d3plot {

/// Throws Error{bad_input} when the name of `file`, which does not begin like a first file, is that of a continuation
/// (`d3plot07` beside `d3plot`).
void refuse_continuation(const std::filesystem::path& file);

/// The first file and its continuations `<name>01` ... `<name>99`, `<name>100`, ... in numeric order; gaps are
/// allowed. Throws Error{unsupported_input} when the family is adaptive.
[[nodiscard]] std::vector<std::filesystem::path> find_family(const std::filesystem::path& first_file);

struct StatePlace {
  std::uint32_t file = 0;  // of the family
  std::uint64_t word = 0;
  double time_s = 0;
};

/// Finds the complete states, each of `state_words`. A state never spans files; an end marker, the end of a file or
/// nothing but zeros ends a file. In the first file states may follow the geometry at `first_word`.
/// Throws Error{bad_input} when a file that others follow is cut short, or times run backwards.
[[nodiscard]] std::vector<StatePlace> index_states(const std::vector<std::filesystem::path>& family,
                                                   std::uint64_t word_bytes, std::uint64_t first_word,
                                                   std::uint64_t state_words);

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
  /// `into.size()` words of state `place`, from word `start` of the state on.
  void read(const StatePlace& place, std::uint64_t start, std::span<float> into);

 private:
  std::vector<std::filesystem::path> family_;
  std::uint32_t open_ = 0;
  WordFile file_;
};

}  // namespace lbea::io::d3plot
