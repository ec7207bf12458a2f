// The geometry part of a d3plot database: nodes, elements and their numbering.
#pragma once

#include "adapters/simulation/d3plot/header.hpp"

namespace lbea::io::d3plot {

/// Elements of one kind. Node indices count from 0, parts are numbers inside the database, from 1.
template <std::size_t Corners>
struct Elements {
  std::vector<std::array<std::uint32_t, Corners>> nodes;
  std::vector<std::uint32_t> parts;
  std::vector<std::uint32_t> ids;

  [[nodiscard]] std::size_t size() const noexcept { return nodes.size(); }
};

struct Geometry {
  std::vector<float> positions;         // nodes x 3
  std::vector<std::uint32_t> node_ids;  // nodes
  Elements<8> solids;
  Elements<4> shells;
  std::vector<std::uint8_t> shell_is_rigid;  // shells; a rigid shell has no row in the states of a d3plot file
  std::uint64_t rigid_shells = 0;
  std::vector<std::uint32_t> part_ids;  // by database number - 1; empty: the number is the id
  std::uint64_t moving_roads = 0;
  std::uint64_t end_word = 0;  // where states may begin in the first file
};

/// Reads what follows the control words. Throws Error{bad_input}.
[[nodiscard]] Geometry read_geometry(const WordFile& file, const Header& header);

}  // namespace lbea::io::d3plot
