// Method step 5: coefficients in the eigenbasis, alpha = Psi' M f for f = x, y, z.
#pragma once

#include "runtime/src/match/positions.hpp"

#include <span>

namespace lbea {

/// `projection` is Psi' M, coefficients.count rows of padded(positions.count) floats; f = positions.
void project(std::span<const float> projection, const Positions& positions, Positions& coefficients) noexcept;

}  // namespace lbea
