// Grids whose files store them in pieces: one per process that computed or wrote them.
#pragma once

#include "adapters/simulation/grid/grid.hpp"

namespace lbea::io::grid {
/// Appends a checked piece without the ghost cells that repeat other pieces, and the end of its points to
/// `whole.piece_ends`. Pieces must have the same arrays, unless they are empty. `file` names the piece.
/// Throws Error{bad_input}.
void add_piece(const Grid& piece, const std::string& file, Grid& whole);
}  // namespace lbea::io::grid
