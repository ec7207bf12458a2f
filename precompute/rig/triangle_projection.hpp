// A triangle before a pinhole camera, as functions of a ray's direction, evaluated on two rays at a time.
#pragma once

#include "precompute/rig/camera.hpp"

#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace lbea::bake {

/// Two numbers in the compiler's vector type: SSE2 and NEON registers, so that every machine computes the same bits.
using Pair = double __attribute__((vector_size(16)));
using PairMask = std::int64_t __attribute__((vector_size(16)));  // all bits of an element are set, or none

[[nodiscard]] inline Pair load_pair(const double* from) {
  Pair pair;
  __builtin_memcpy(&pair, from, sizeof(pair));
  return pair;
}
inline void store_pair(double* to, Pair pair) { __builtin_memcpy(to, &pair, sizeof(pair)); }
[[nodiscard]] inline PairMask load_mask(const std::uint64_t* from) {
  PairMask mask;
  __builtin_memcpy(&mask, from, sizeof(mask));
  return mask;
}
inline void store_mask(std::uint64_t* to, PairMask mask) { __builtin_memcpy(to, &mask, sizeof(mask)); }

/// Element by element: a where `holds`, else b.
[[nodiscard]] inline PairMask choose(PairMask holds, PairMask a, PairMask b) { return (holds & a) | (~holds & b); }
[[nodiscard]] inline Pair choose(PairMask holds, Pair a, Pair b) {
  return Pair(choose(holds, PairMask(a), PairMask(b)));
}
/// Element by element; b when a is NaN.
[[nodiscard]] inline Pair lesser(Pair a, Pair b) {
#if defined(__SSE2__)
  return Pair(_mm_min_pd(__m128d(a), __m128d(b)));
#else
  return a < b ? a : b;
#endif
}
[[nodiscard]] inline Pair greater(Pair a, Pair b) {
#if defined(__SSE2__)
  return Pair(_mm_max_pd(__m128d(a), __m128d(b)));
#else
  return a > b ? a : b;
#endif
}
[[nodiscard]] inline bool any(PairMask mask) {
#if defined(__SSE2__)
  return _mm_movemask_pd(__m128d(mask)) != 0;
#else
  return (mask[0] | mask[1]) != 0;
#endif
}

/// Rays of the directions (x, y, 1), in homogeneous coordinates (Olano and Greer 1997): such a ray d from the eye meets
/// the triangle a, b, c where (a x b) d, (b x c) d and (c x a) d have the same sign, and there 1 / z = n d / (n a). All
/// are linear in d, need no clipping, and are the same for the two triangles of an edge: no ray passes between them.
class TriangleProjection {
 public:
  /// Degenerate when the eye lies in the triangle's plane, up to rounding.
  TriangleProjection(const Vec3& a, const Vec3& b, const Vec3& c) {
    constexpr double least_share = 1e-10;  // of a sum in its summands: below it, rounding matters
    const Vec3 normal = cross(b - a, c - a);
    const double volume = dot(normal, a);
    const double summands = std::abs(normal.x * a.x) + std::abs(normal.y * a.y) + std::abs(normal.z * a.z);
    is_degenerate_ = !(std::abs(volume) > least_share * summands) || !std::isfinite(volume);
    const double sign = volume > 0 ? 1 : -1;
    edges_[0] = Function(cross(a, b), sign);
    edges_[1] = Function(cross(b, c), sign);
    edges_[2] = Function(cross(c, a), sign);
    inverse_depth_ = Function(normal, 1 / volume);
  }
  [[nodiscard]] bool is_degenerate() const { return is_degenerate_; }

  /// In one row of pixels, of x alone.
  class Row {
   public:
    Row(const TriangleProjection& triangle, double y)
        : edges_{{triangle.edges_[0], y}, {triangle.edges_[1], y}, {triangle.edges_[2], y}},
          inverse_depth_(triangle.inverse_depth_, y) {}
    [[nodiscard]] PairMask contains(Pair x) const {
      return (edges_[0](x) >= 0.0) & (edges_[1](x) >= 0.0) & (edges_[2](x) >= 0.0);
    }
    /// 1 / z of the triangle's plane.
    [[nodiscard]] Pair inverse_depth(Pair x) const { return inverse_depth_(x); }

   private:
    struct Linear {
      Pair factor, constant;
      Linear(const auto& function, double y)
          : factor(Pair{} + function.x), constant(Pair{} + (function.y * y + function.z)) {}
      Pair operator()(Pair x) const { return factor * x + constant; }
    };
    Linear edges_[3], inverse_depth_;
  };

  [[nodiscard]] PairMask contains(Pair x, Pair y) const {
    return (edges_[0](x, y) >= 0.0) & (edges_[1](x, y) >= 0.0) & (edges_[2](x, y) >= 0.0);
  }
  [[nodiscard]] Pair inverse_depth(Pair x, Pair y) const { return inverse_depth_(x, y); }

 private:
  struct Function {
    double x = 0, y = 0, z = 0;
    Function() = default;
    Function(const Vec3& v, double factor) : x(factor * v.x), y(factor * v.y), z(factor * v.z) {}
    Pair operator()(Pair at_x, Pair at_y) const { return x * at_x + (y * at_y + z); }
  };

  bool is_degenerate_ = false;
  Function edges_[3];  // none negative: inside
  Function inverse_depth_;
};

}  // namespace lbea::bake
