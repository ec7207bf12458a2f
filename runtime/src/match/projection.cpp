#include "runtime/src/match/projection.hpp"

#include "runtime/src/kernels/kernels.hpp"

namespace lbea {

void project(std::span<const float> projection, const Positions& positions, Positions& coefficients) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis)
    kernels().project(projection.data(), coefficients.count, positions.planes[axis].size(),
                      positions.planes[axis].data(), coefficients.planes[axis].data());
}

}  // namespace lbea
