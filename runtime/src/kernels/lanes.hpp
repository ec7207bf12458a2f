// Sixteen floats at a time in the compiler's vector types: one source becomes SSE2, AVX2, AVX-512 or NEON code. There
// are always sixteen lanes, so that sums are added in the same order and every machine computes the same bits. Narrower
// registers are used in groups: compilers keep a vector that is wider than their registers in memory.
//
// Only kernel files include this. No standard-library templates here: the linker could keep an inline function compiled
// for AVX-512 as the one copy for all.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__AVX512F__) || defined(__AVX2__) || defined(__SSE2__)
#include <immintrin.h>
#endif

namespace lbea::LBEA_KERNELS {

inline constexpr std::size_t lanes = 16;
#if defined(__AVX512F__)
inline constexpr std::size_t register_bytes = 64;
#elif defined(__AVX2__)
inline constexpr std::size_t register_bytes = 32;
#else
inline constexpr std::size_t register_bytes = 16;
#endif

template <typename Scalar>
struct Lanes {
  static constexpr std::size_t parts = lanes * sizeof(Scalar) / register_bytes, width = lanes / parts;
  typedef Scalar Part __attribute__((vector_size(register_bytes)));
  Part part[parts];

  Scalar operator[](std::size_t lane) const { return part[lane / width][lane % width]; }
};
using Floats = Lanes<float>;
using Ints = Lanes<std::int32_t>;

/// Part by part.
template <typename Result, typename Work>
static inline Result each(Work work) {
  Result result;
  for (std::size_t i = 0; i < Result::parts; ++i) result.part[i] = work(i);
  return result;
}
template <typename Scalar>
static inline Lanes<Scalar> all_of(Scalar value) {
  return each<Lanes<Scalar>>([&](std::size_t) { return typename Lanes<Scalar>::Part{} + value; });
}
static inline Floats all(float value) { return all_of(value); }

#define LBEA_LANES_BINARY(op)                                                               \
  template <typename Scalar>                                                                \
  static inline Lanes<Scalar> operator op(const Lanes<Scalar>& a, const Lanes<Scalar>& b) { \
    return each<Lanes<Scalar>>([&](std::size_t i) { return a.part[i] op b.part[i]; });      \
  }                                                                                         \
  template <typename Scalar>                                                                \
  static inline Lanes<Scalar> operator op(const Lanes<Scalar>& a, Scalar b) {               \
    return each<Lanes<Scalar>>([&](std::size_t i) { return a.part[i] op b; });              \
  }                                                                                         \
  template <typename Scalar>                                                                \
  static inline Lanes<Scalar> operator op(Scalar a, const Lanes<Scalar>& b) {               \
    return each<Lanes<Scalar>>([&](std::size_t i) { return a op b.part[i]; });              \
  }
LBEA_LANES_BINARY(+)
LBEA_LANES_BINARY(-)
LBEA_LANES_BINARY(*)
LBEA_LANES_BINARY(/)
LBEA_LANES_BINARY(&)
LBEA_LANES_BINARY(|)
LBEA_LANES_BINARY(^)
LBEA_LANES_BINARY(<<)
LBEA_LANES_BINARY(>>)
#undef LBEA_LANES_BINARY

/// All bits of a lane are set where the comparison holds, none elsewhere.
#define LBEA_LANES_COMPARISON(op)                                                       \
  static inline Ints operator op(const Floats& a, const Floats& b) {                    \
    return each<Ints>([&](std::size_t i) { return a.part[i] op b.part[i]; });           \
  }                                                                                     \
  static inline Ints operator op(const Floats& a, float b) {                            \
    return each<Ints>([&](std::size_t i) { return a.part[i] op(Floats::Part{} + b); }); \
  }                                                                                     \
  static inline Ints operator op(const Ints& a, std::int32_t b) {                       \
    return each<Ints>([&](std::size_t i) { return a.part[i] op(Ints::Part{} + b); });   \
  }
LBEA_LANES_COMPARISON(<)
LBEA_LANES_COMPARISON(>)
LBEA_LANES_COMPARISON(<=)
LBEA_LANES_COMPARISON(>=)
LBEA_LANES_COMPARISON(!=)
#undef LBEA_LANES_COMPARISON

template <typename Scalar>
static inline Lanes<Scalar> operator-(const Lanes<Scalar>& a) {
  return each<Lanes<Scalar>>([&](std::size_t i) { return -a.part[i]; });
}
static inline Ints operator<(const Ints& a, const Ints& b) {
  return each<Ints>([&](std::size_t i) { return a.part[i] < b.part[i]; });
}
template <typename Scalar, typename Other>
static inline Lanes<Scalar>& operator+=(Lanes<Scalar>& a, const Other& b) {
  return a = a + b;
}
static inline Ints& operator&=(Ints& a, const Ints& b) { return a = a & b; }

/// Lane by lane: a where `holds`, else b.
template <typename Scalar>
static inline Lanes<Scalar> choose(const Ints& holds, const Lanes<Scalar>& a, const Lanes<Scalar>& b) {
  return each<Lanes<Scalar>>([&](std::size_t i) { return holds.part[i] ? a.part[i] : b.part[i]; });
}

// Register by register: a copy of the whole vector would go through memory.
template <typename Vector, typename Scalar>
static inline Vector loaded(const Scalar* from) {
  static_assert(sizeof(Scalar) * lanes == sizeof(Vector));
  return each<Vector>([&](std::size_t i) {
    typename Vector::Part part;
    __builtin_memcpy(&part, from + i * Vector::width, sizeof(part));
    return part;
  });
}
static inline Floats load(const float* from) { return loaded<Floats>(from); }
static inline Floats::Part load_part(const float* from, std::size_t i) {
  Floats::Part part;
  __builtin_memcpy(&part, from + i * Floats::width, sizeof(part));
  return part;
}
template <typename Scalar, typename Vector>
static inline void store(Scalar* to, const Vector& value) {
  static_assert(sizeof(Scalar) * lanes == sizeof(Vector));
  for (std::size_t i = 0; i < Vector::parts; ++i)
    __builtin_memcpy(to + i * Vector::width, &value.part[i], sizeof(value.part[i]));
}

#if defined(__AVX512F__)
constexpr __mmask16 every_lane = 0xffff;  // explicit: GCC 12 warns in its own header otherwise
#endif

/// Sixteen 16-bit numbers.
static inline Ints load_shorts(const std::uint16_t* from) {
  return each<Ints>([&](std::size_t i) {
#if defined(__AVX512F__)
    __m256i values;
    __builtin_memcpy(&values, from + i * Ints::width, sizeof(values));
    return Ints::Part(_mm512_maskz_cvtepu16_epi32(every_lane, values));
#else
    typedef std::uint16_t Halves __attribute__((vector_size(register_bytes / 2)));
    Halves values;
    __builtin_memcpy(&values, from + i * Ints::width, sizeof(values));
    return __builtin_convertvector(values, Ints::Part);
#endif
  });
}

/// 32 numbers of 16 bits in as many registers as sixteen of 32 bits.
struct Shorts {
  static constexpr std::size_t parts = Ints::parts, width = 2 * Ints::width;
  typedef std::uint16_t Part __attribute__((vector_size(register_bytes)));
  Part part[parts];
};
static inline Shorts::Part load_part(const std::uint16_t* from, std::size_t i) {
  Shorts::Part part;
  __builtin_memcpy(&part, from + i * Shorts::width, sizeof(part));
  return part;
}
/// All bits are set where a number is not 0.
static inline Shorts::Part is_filled(Shorts::Part v) { return Shorts::Part(v != 0); }
/// a - b, at least 0.
static inline Shorts::Part reduced(Shorts::Part a, Shorts::Part b) {
#if defined(__AVX512F__)
  return Shorts::Part(_mm512_maskz_subs_epu16(0xffffffff, __m512i(a), __m512i(b)));
#elif defined(__AVX2__)
  return Shorts::Part(_mm256_subs_epu16(__m256i(a), __m256i(b)));
#elif defined(__SSE2__)
  return Shorts::Part(_mm_subs_epu16(__m128i(a), __m128i(b)));
#else
  return a > b ? a - b : Shorts::Part{};
#endif
}
/// Products of numbers below 2^15, pairs of them added.
static inline Ints::Part pair_sums(Shorts::Part a, Shorts::Part b) {
#if defined(__AVX512F__)
  return Ints::Part(_mm512_maskz_madd_epi16(every_lane, __m512i(a), __m512i(b)));
#elif defined(__AVX2__)
  return Ints::Part(_mm256_madd_epi16(__m256i(a), __m256i(b)));
#elif defined(__SSE2__)
  return Ints::Part(_mm_madd_epi16(__m128i(a), __m128i(b)));
#else
  Ints::Part sums;
  for (std::size_t i = 0; i < Ints::width; ++i)
    sums[i] = std::int32_t{a[2 * i]} * std::int32_t{b[2 * i]} + std::int32_t{a[2 * i + 1]} * std::int32_t{b[2 * i + 1]};
  return sums;
#endif
}
static inline Ints pair_sums(const Shorts& v) {
  return each<Ints>([&](std::size_t i) { return pair_sums(v.part[i], Shorts::Part{} + std::uint16_t{1}); });
}

/// Truncated. The caller must avoid values that an int cannot represent.
static inline Ints to_ints(const Floats& value) {
  return each<Ints>([&](std::size_t i) { return __builtin_convertvector(value.part[i], Ints::Part); });
}
static inline Floats to_floats(const Ints& value) {
  return each<Floats>([&](std::size_t i) { return __builtin_convertvector(value.part[i], Floats::Part); });
}

// A comparison with NaN is false and selects the second operand: lesser(NaN, b) = b. The processors' instructions do
// the same, but compilers use them only when NaN may be ignored.
static inline Floats::Part lesser(Floats::Part a, Floats::Part b) {
#if defined(__AVX512F__)
  return Floats::Part(_mm512_maskz_min_ps(every_lane, __m512(a), __m512(b)));
#elif defined(__AVX2__)
  return Floats::Part(_mm256_min_ps(__m256(a), __m256(b)));
#elif defined(__SSE2__)
  return Floats::Part(_mm_min_ps(__m128(a), __m128(b)));
#else
  return a < b ? a : b;
#endif
}
static inline Floats::Part greater(Floats::Part a, Floats::Part b) {
#if defined(__AVX512F__)
  return Floats::Part(_mm512_maskz_max_ps(every_lane, __m512(a), __m512(b)));
#elif defined(__AVX2__)
  return Floats::Part(_mm256_max_ps(__m256(a), __m256(b)));
#elif defined(__SSE2__)
  return Floats::Part(_mm_max_ps(__m128(a), __m128(b)));
#else
  return a > b ? a : b;
#endif
}
static inline Floats minimum(const Floats& a, const Floats& b) {
  return each<Floats>([&](std::size_t i) { return lesser(a.part[i], b.part[i]); });
}
static inline Floats maximum(const Floats& a, const Floats& b) {
  return each<Floats>([&](std::size_t i) { return greater(a.part[i], b.part[i]); });
}

static inline Floats square_roots(const Floats& value) {
  return each<Floats>([&](std::size_t i) {
#if defined(__AVX512F__)
    return Floats::Part(_mm512_sqrt_ps(__m512(value.part[i])));
#elif defined(__AVX2__)
    return Floats::Part(_mm256_sqrt_ps(__m256(value.part[i])));
#elif defined(__SSE2__)
    return Floats::Part(_mm_sqrt_ps(__m128(value.part[i])));
#else
    Floats::Part roots = value.part[i];
    for (std::size_t lane = 0; lane < Floats::width; ++lane) roots[lane] = __builtin_sqrtf(roots[lane]);
    return roots;
#endif
  });
}

#if !defined(__SSE2__)
/// Bit i: the lane is true, that is, has all bits set.
static inline std::uint32_t bits_of(const Ints& truth) {
  constexpr std::int32_t bit[lanes] = {1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                                       1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};
  const Ints bits = truth & loaded<Ints>(bit);
  Ints::Part sum = (bits.part[0] | bits.part[1]) | (bits.part[2] | bits.part[3]);
  sum |= __builtin_shufflevector(sum, sum, 2, 3, 0, 1);
  sum |= __builtin_shufflevector(sum, sum, 1, 0, 3, 2);
  return static_cast<std::uint32_t>(sum[0]);
}
#endif

/// Bit i: a[i] <= b[i].
static inline std::uint32_t at_most(const Floats& a, const Floats& b) {
#if defined(__AVX512F__)
  return _mm512_cmp_ps_mask(__m512(a.part[0]), __m512(b.part[0]), _CMP_LE_OQ);
#elif !defined(__SSE2__)
  return bits_of(a <= b);
#else
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < Floats::parts; ++i) {
#if defined(__AVX2__)
    const int part = _mm256_movemask_ps(_mm256_cmp_ps(__m256(a.part[i]), __m256(b.part[i]), _CMP_LE_OQ));
#else
    const int part = _mm_movemask_ps(_mm_cmple_ps(__m128(a.part[i]), __m128(b.part[i])));
#endif
    bits |= static_cast<std::uint32_t>(part) << (Floats::width * i);
  }
  return bits;
#endif
}

/// All bits of lane i are set where bit i is.
static inline Ints lanes_of(std::uint32_t bits) {
  std::int32_t one[lanes];
  for (std::size_t i = 0; i < lanes; ++i) one[i] = 1 << i;
  return (loaded<Ints>(one) & all_of(static_cast<std::int32_t>(bits))) != 0;
}

/// Bit i: a[i] != b[i].
static inline std::uint32_t differing(const Ints& a, const Ints& b) {
#if defined(__AVX512F__)
  return _mm512_cmpneq_epi32_mask(__m512i(a.part[0]), __m512i(b.part[0]));
#elif !defined(__SSE2__)
  return bits_of(each<Ints>([&](std::size_t i) { return a.part[i] != b.part[i]; }));
#else
  std::uint32_t equal = 0;
  for (std::size_t i = 0; i < Ints::parts; ++i) {
#if defined(__AVX2__)
    const int part =
        _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(__m256i(a.part[i]), __m256i(b.part[i]))));
#else
    const int part = _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(__m128i(a.part[i]), __m128i(b.part[i]))));
#endif
    equal |= static_cast<std::uint32_t>(part) << (Ints::width * i);
  }
  return ~equal & 0xffff;
#endif
}

/// Writes first + i for every set bit i, consecutively, and returns their number. May write up to sixteen numbers,
/// whatever the bits.
static inline std::size_t append_lanes(std::uint32_t* to, std::uint32_t first, std::uint32_t bits) {
#if defined(__AVX512F__)
  const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i numbers = _mm512_add_epi32(lane, _mm512_set1_epi32(static_cast<int>(first)));
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), numbers));
#else
  std::size_t count = 0;
  for (std::uint32_t rest = bits; rest != 0; rest &= rest - 1)
    to[count++] = first + static_cast<std::uint32_t>(__builtin_ctz(rest));
#endif
  return static_cast<std::size_t>(__builtin_popcount(bits));
}

#if defined(__AVX512F__)
/// Lanes of two vectors by number: 0-15 of the first, 16-31 of the second.
template <int... Lane>
static inline Floats pick(const Floats& a, const Floats& b) {
  return {{__builtin_shufflevector(a.part[0], b.part[0], Lane...)}};
}
#endif

/// Four lanes: a point's four coordinates, or one coordinate of four points.
using Four = float __attribute__((vector_size(16)));

static inline Four load_four(const float* from) {
  Four value;
  __builtin_memcpy(&value, from, sizeof(value));
  return value;
}
static inline void store_four(float* to, Four value) { __builtin_memcpy(to, &value, sizeof(value)); }

/// Rows become columns.
struct Fours {
  Four at[4];
};
static inline Fours transposed(const Fours& rows) {
  const auto& [a, b, c, d] = rows.at;
  const Four low_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), high_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four low_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5), high_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  return {{__builtin_shufflevector(low_ab, low_cd, 0, 1, 4, 5), __builtin_shufflevector(low_ab, low_cd, 2, 3, 6, 7),
           __builtin_shufflevector(high_ab, high_cd, 0, 1, 4, 5),
           __builtin_shufflevector(high_ab, high_cd, 2, 3, 6, 7)}};
}

#if !defined(__AVX512F__)
static inline Floats joined(const Fours& fours) {
#if defined(__AVX2__)
  return {{__builtin_shufflevector(fours.at[0], fours.at[1], 0, 1, 2, 3, 4, 5, 6, 7),
           __builtin_shufflevector(fours.at[2], fours.at[3], 0, 1, 2, 3, 4, 5, 6, 7)}};
#else
  return {{fours.at[0], fours.at[1], fours.at[2], fours.at[3]}};
#endif
}
static inline Fours divided(const Floats& value) {
#if defined(__AVX2__)
  const auto low = [](Floats::Part v) { return __builtin_shufflevector(v, v, 0, 1, 2, 3); };
  const auto high = [](Floats::Part v) { return __builtin_shufflevector(v, v, 4, 5, 6, 7); };
  return {{low(value.part[0]), high(value.part[0]), low(value.part[1]), high(value.part[1])}};
#else
  return {{value.part[0], value.part[1], value.part[2], value.part[3]}};
#endif
}
#endif

/// Each step folds the upper half of the lanes onto the lower one.
template <typename Fold>
static inline float folded(const Floats& value, Fold fold) {
  Floats::Part part[Floats::parts];
  for (std::size_t i = 0; i < Floats::parts; ++i) part[i] = value.part[i];
  for (std::size_t half = Floats::parts / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) part[i] = fold(part[i], part[i + half]);
#if defined(__AVX512F__)
  part[0] =
      fold(part[0], __builtin_shufflevector(part[0], part[0], 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7));
  part[0] =
      fold(part[0], __builtin_shufflevector(part[0], part[0], 4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11));
  part[0] =
      fold(part[0], __builtin_shufflevector(part[0], part[0], 2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13));
  part[0] =
      fold(part[0], __builtin_shufflevector(part[0], part[0], 1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14));
#elif defined(__AVX2__)
  part[0] = fold(part[0], __builtin_shufflevector(part[0], part[0], 4, 5, 6, 7, 0, 1, 2, 3));
  part[0] = fold(part[0], __builtin_shufflevector(part[0], part[0], 2, 3, 0, 1, 6, 7, 4, 5));
  part[0] = fold(part[0], __builtin_shufflevector(part[0], part[0], 1, 0, 3, 2, 5, 4, 7, 6));
#else
  part[0] = fold(part[0], __builtin_shufflevector(part[0], part[0], 2, 3, 0, 1));
  part[0] = fold(part[0], __builtin_shufflevector(part[0], part[0], 1, 0, 3, 2));
#endif
  return part[0][0];
}
static inline float greatest(const Floats& value) { return folded(value, greater); }
static inline float least(const Floats& value) { return folded(value, lesser); }

/// In a fixed order: halves, quarters, eighths, sixteenths.
static inline float sum(const Floats& value) {
  return folded(value, [](Floats::Part a, Floats::Part b) { return a + b; });
}

}  // namespace lbea::LBEA_KERNELS
