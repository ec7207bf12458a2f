// The depth images' part of the kernel table, in the namespace of the instruction set that is being compiled.
#pragma once

#include "runtime/src/kernels/kernels.hpp"

namespace lbea::LBEA_KERNELS {

void add_depths(const Leaf* leaves, std::size_t count, const float T[12], const CellRaster& raster, CellTally* tallies);
CellSums compare_views(const float* observed, const std::uint16_t* sample, std::size_t cells, const CellPrices& prices);
void subtract_views(const float* observed, const std::uint16_t* sample, std::size_t cells, const CellPrices& prices,
                    float* residual);

}  // namespace lbea::LBEA_KERNELS
