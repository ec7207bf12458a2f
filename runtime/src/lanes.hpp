// Sixteen floats at a time, in the compiler's own vector types: one source becomes SSE2, AVX2, AVX-512 or NEON code,
// whichever the file that includes it is compiled for. Sixteen lanes everywhere, so that sums are added in the same
// order and every machine gets the same bits.
//
// Included by kernel_code.cpp alone. No standard-library templates here: an inline function compiled for AVX-512 must
// not be the copy that the linker keeps for everyone.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__AVX512F__) || defined(__AVX2__) || defined(__SSE2__)
#include <immintrin.h>
#endif

namespace lbea::LBEA_KERNELS {

inline constexpr std::size_t lanes = 16;
using Floats = float __attribute__((vector_size(64)));
using Ints = std::int32_t __attribute__((vector_size(64)));

static inline Floats load(const float* from) {
  Floats value;
  __builtin_memcpy(&value, from, sizeof(value));
  return value;
}
template <typename Scalar, typename Vector>
static inline void store(Scalar* to, Vector value) {
  static_assert(sizeof(Scalar) * lanes == sizeof(Vector));
  __builtin_memcpy(to, &value, sizeof(value));
}
static inline Floats all(float value) { return Floats{} + value; }
// A comparison with NaN is false, so the second operand wins: minimum(NaN, b) = b.
static inline Floats minimum(Floats a, Floats b) { return a < b ? a : b; }
static inline Floats maximum(Floats a, Floats b) { return a > b ? a : b; }

static inline Floats square_roots(Floats value) {
#if defined(__AVX512F__)
  return reinterpret_cast<Floats>(_mm512_sqrt_ps(reinterpret_cast<__m512>(value)));
#else
  for (std::size_t i = 0; i < lanes; ++i) value[i] = __builtin_sqrtf(value[i]);
  return value;
#endif
}

/// Bit i: a[i] <= b[i].
static inline std::uint32_t at_most(Floats a, Floats b) {
#if defined(__AVX512F__)
  return _mm512_cmp_ps_mask(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b), _CMP_LE_OQ);
#elif defined(__SSE2__)
  const Ints holds = a <= b;
  std::uint32_t bits = 0;
#if defined(__AVX2__)
  __m256 part[2];
  __builtin_memcpy(part, &holds, sizeof(part));
  for (unsigned i = 0; i < 2; ++i) bits |= static_cast<std::uint32_t>(_mm256_movemask_ps(part[i])) << (8 * i);
#else
  __m128 part[4];
  __builtin_memcpy(part, &holds, sizeof(part));
  for (unsigned i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(_mm_movemask_ps(part[i])) << (4 * i);
#endif
  return bits;
#else
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < lanes; ++i) bits |= static_cast<std::uint32_t>(a[i] <= b[i]) << i;
  return bits;
#endif
}

/// Lanes of two vectors by number: 0-15 of the first, 16-31 of the second.
template <int... Lane>
static inline Floats pick(Floats a, Floats b) {
  return __builtin_shufflevector(a, b, Lane...);
}

/// By halves: each step folds the upper lanes onto the lower ones.
template <typename Fold>
static inline float folded(Floats value, Fold fold) {
  value = fold(value, pick<8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7>(value, value));
  value = fold(value, pick<4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11>(value, value));
  value = fold(value, pick<2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13>(value, value));
  value = fold(value, pick<1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14>(value, value));
  return value[0];
}
static inline float greatest(Floats value) { return folded(value, maximum); }

/// In a fixed order: halves, quarters, eighths, sixteenths.
static inline float sum(Floats value) {
  return folded(value, [](Floats a, Floats b) { return a + b; });
}

}  // namespace lbea::LBEA_KERNELS
