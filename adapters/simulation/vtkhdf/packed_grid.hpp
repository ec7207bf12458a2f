// A grid as bytes, on its way from the child process that reads it.
#pragma once

#include "adapters/simulation/grid/grid.hpp"
#include "adapters/simulation/vtkhdf/child.hpp"

namespace lbea::io::vtkhdf {
[[nodiscard]] child::Bytes packed(const grid::Grid& grid);
/// Throws std::out_of_range when these are not the bytes of a grid. Its cells and arrays are not checked.
[[nodiscard]] grid::Grid unpacked(const child::Bytes& bytes);
}  // namespace lbea::io::vtkhdf
