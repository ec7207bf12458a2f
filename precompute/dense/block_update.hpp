// The inner loop of symmetric_inverse.cpp, compiled once per instruction set.
#pragma once

#include <cstddef>

namespace lbea::bake {

/// Rows and columns of one sweep, and of the parts into which a matrix is divided.
struct BlockSizes {
  static constexpr std::size_t sweep = 64, rows = 4, columns = 32;
};

/// matrix -= w v: height x size numbers, row by row; height: a multiple of rows, size: of columns. is_lower: of a
/// square matrix, what lies above the diagonal may be left as it is. w: for every `rows` rows of the matrix, `sweep`
/// times `rows` numbers; v: sweep x size.
using BlockUpdate = void (*)(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v,
                             double* matrix);

/// All that this processor can run, the fastest first, then null.
[[nodiscard]] const BlockUpdate* block_updates() noexcept;

}  // namespace lbea::bake
