// The search's part of the kernel table, in the namespace of the instruction set that is being compiled.
#pragma once

#include "runtime/src/kernels/kernels.hpp"

namespace lbea::LBEA_KERNELS {

NearestPoint nearest(const CloudTree& tree, const float query[3], NearestPoint bound);
void nearest_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best);

}  // namespace lbea::LBEA_KERNELS
