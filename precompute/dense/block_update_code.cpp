// Every number of the matrix is summed in its own lane, in the same order on every processor. As in
// runtime/src/kernels, no function here may be shared with other files: the linker could keep the one compiled for
// AVX-512.
#include "precompute/dense/block_update.hpp"

namespace lbea::bake {
namespace LBEA_BLOCK_UPDATE {
namespace {

#if defined(__AVX512F__)
constexpr std::size_t register_bytes = 64;
#elif defined(__AVX2__)
constexpr std::size_t register_bytes = 32;
#else
constexpr std::size_t register_bytes = 16;
#endif
typedef double Part __attribute__((vector_size(register_bytes)));
constexpr std::size_t width = register_bytes / sizeof(double), parts = 2, rows = BlockSizes::rows;

Part load(const double* from) {
  Part part;
  __builtin_memcpy(&part, from, sizeof(part));
  return part;
}

void update_tile(std::size_t size, const double* w, const double* v, double* matrix) {
  Part sums[rows][parts];
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t p = 0; p < parts; ++p) sums[r][p] = load(matrix + r * size + p * width);
  for (std::size_t k = 0; k < BlockSizes::sweep; ++k) {
    Part factor[parts];
    for (std::size_t p = 0; p < parts; ++p) factor[p] = load(v + k * BlockSizes::columns + p * width);
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t p = 0; p < parts; ++p) sums[r][p] -= w[k * rows + r] * factor[p];
  }
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t p = 0; p < parts; ++p) __builtin_memcpy(matrix + r * size + p * width, &sums[r][p], sizeof(Part));
}

}  // namespace

void update(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v, double* matrix);
void update(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v, double* matrix) {
  constexpr std::size_t columns = BlockSizes::columns, depth = BlockSizes::sweep;
  for (std::size_t first = 0; first < size; first += columns) {
    double of_block[depth * columns];  // close together, they stay in the fastest cache
    for (std::size_t k = 0; k < depth; ++k)
      __builtin_memcpy(of_block + k * columns, v + k * size + first, columns * sizeof(double));
    for (std::size_t row = is_lower ? first : 0; row < height; row += rows)
      for (std::size_t column = 0; column < columns; column += parts * width)
        update_tile(size, w + row * depth, of_block + column, matrix + row * size + first + column);
  }
}

}  // namespace LBEA_BLOCK_UPDATE
}  // namespace lbea::bake
