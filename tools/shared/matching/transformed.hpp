// A point in another coordinate system.
#pragma once

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// T p, T a 3 x 4 matrix.
[[nodiscard]] inline Point transformed(const RigidTransform& T, const Point& p) noexcept {
  return {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3], T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],
          T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
}

}  // namespace lbea::tool
