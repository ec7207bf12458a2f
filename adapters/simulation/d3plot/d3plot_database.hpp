// A d3plot database opened: control words, geometry, layout and the places of its states.
#pragma once

#include <filesystem>
#include <vector>

#include "adapters/simulation/d3plot/d3plot_family.hpp"
#include "adapters/simulation/d3plot/d3plot_geometry.hpp"
#include "adapters/simulation/d3plot/d3plot_layout.hpp"

namespace lbea::io::d3plot {

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
