// Applying a rigid transform to a point (method step 1).
#pragma once

#include <lbea/lbea.hpp>

#include <array>

namespace lbea {

inline std::array<float, 3> apply(const RigidTransform& T, const Point& p) noexcept {
  return {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3],  //
          T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],  //
          T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
}

}  // namespace lbea
