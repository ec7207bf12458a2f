// Building and comparing small clouds.
#pragma once

#include "adapters/clouds/point_cloud.hpp"
#include "tests/support/refusals.hpp"

#include <cmath>
#include <string>
#include <vector>

namespace lbea::io {
ParseCloud parse_ply, parse_xyz;
}

namespace lbea::test {

using namespace lbea::io;

inline std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

inline bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// Equal bit for bit, NaN equal to NaN.
inline bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!same(a[i].x, b[i].x) || !same(a[i].y, b[i].y) || !same(a[i].z, b[i].z)) return false;
  return true;
}

}  // namespace lbea::test
