// The solver's numbers of nodes, elements and parts (the NARBS block).
#pragma once

#include "adapters/simulation/d3plot/d3plot_geometry.hpp"

namespace lbea::io::d3plot {

/// Fills the ids of `geometry` from the numbering block at `word`; counts from 1 where the file has none.
/// Throws Error{bad_input} when the block does not fit the elements of the database.
void read_numbering(const WordFile& file, std::uint64_t word, const Header& header, Geometry& geometry);

}  // namespace lbea::io::d3plot
