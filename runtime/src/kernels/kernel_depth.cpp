// Depth images, cell by cell. Compiled once per instruction set, like kernel_code.cpp.
#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/kernels/lanes.hpp"

namespace lbea::LBEA_KERNELS {
namespace {

constexpr float largest_cell = 1e6f;

using Shorts = std::uint16_t __attribute__((vector_size(register_bytes / 2)));  // for a register of ints

Floats load_depths(const std::uint16_t* from) {
  return to_floats(each<Ints>([&](std::size_t i) {
    Shorts values;
    __builtin_memcpy(&values, from + i * Ints::width, sizeof(values));
    return __builtin_convertvector(values, Ints::Part);
  }));
}

Floats row(const float* T, Floats x, Floats y, Floats z) { return T[0] * x + T[1] * y + T[2] * z + T[3]; }

// The cell's number, truncated; a coordinate that is not finite becomes a number outside.
Ints cell_number(const Floats& cell) { return to_ints(minimum(maximum(cell, all(-1.0f)), all(largest_cell))); }

struct Cells {
  Floats squares;  // of the capped difference, or of the cost of a cell that only one image fills
  Floats filled;   // 1 where at least one image fills the cell
};

Cells compare(Floats observed, Floats sample, const CellPrices& prices) {
  const Ints in_frame = observed >= 0.0f, in_sample = (sample > 0.0f) & (observed > not_observed);
  const Floats difference = observed - sample;
  const Floats capped = maximum(minimum(difference, all(prices.cap)), all(-prices.cap));
  const Floats one_sided = choose(in_frame ^ in_sample, all(prices.one_sided), Floats{});
  const Floats cost = choose(in_frame & in_sample, capped, one_sided);
  return {cost * cost, choose(in_frame | in_sample, all(1.0f), Floats{})};
}

}  // namespace

void add_depths(const Leaf* leaves, std::size_t count, const float T[12], const CellRaster& raster,
                CellTally* tallies) {
  const auto columns = static_cast<std::int32_t>(raster.columns), rows = static_cast<std::int32_t>(raster.rows);
  for (std::size_t leaf = 0; leaf < count; ++leaf) {
    const Floats x = load(leaves[leaf].x), y = load(leaves[leaf].y), z = load(leaves[leaf].z);
    const Floats depth = row(T + 8, x, y, z);
    const Floats scale = raster.focal / depth;
    const Floats u = row(T, x, y, z) * scale + raster.center_column,
                 v = row(T + 4, x, y, z) * scale + raster.center_row;
    const Ints column = cell_number(u), line = cell_number(v);
    const Ints inside = (u >= 0.0f) & (v >= 0.0f) & (column < columns) & (line < rows) & (depth > 0.0f);
    const Ints cells = choose(inside, line * columns + column, all_of(columns * rows));
    std::int32_t cell[lanes];
    float value[lanes];
    store(cell, cells);
    store(value, (depth - raster.depth_origin) * raster.steps_per_depth);
    for (std::size_t i = 0; i < lanes; ++i) {
      CellTally& tally = tallies[cell[i]];
      tally.depth[i % 4] += value[i];
      tally.points[i % 4] += 1.0f;
    }
  }
}

CellSums compare_depths(const float* observed, const std::uint16_t* sample, std::size_t cells,
                        const CellPrices& prices) {
  Floats squares{}, filled{};
  for (std::size_t i = 0; i < cells; i += lanes) {
    const Cells compared = compare(load(observed + i), load_depths(sample + i), prices);
    squares += compared.squares;
    filled += compared.filled;
  }
  return {sum(squares), sum(filled)};
}

void subtract_depths(const float* observed, const std::uint16_t* sample, std::size_t cells, const CellPrices& prices,
                     float* residual) {
  for (std::size_t i = 0; i < cells; i += lanes) {
    const Floats seen = load(observed + i), expected = load_depths(sample + i);
    const Ints in_frame = seen >= 0.0f, in_sample = (expected > 0.0f) & (seen > not_observed);
    const Floats capped = maximum(minimum(expected - seen, all(prices.cap)), all(-prices.cap));
    const Floats one_sided = choose(in_frame, all(-prices.one_sided), all(prices.one_sided));
    const Floats either = choose(in_frame ^ in_sample, one_sided, Floats{});
    store(residual + i, choose(in_frame & in_sample, capped, either));
  }
}

}  // namespace lbea::LBEA_KERNELS
