// Fields in 16 bits: equal steps between the least and the greatest value of one sample.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace lbea {
using FieldCode = std::uint16_t;

// Infinities and NaN have codes of their own.
inline constexpr FieldCode last_code = 65'532;
inline constexpr FieldCode code_of_minus_infinity = 65'533, code_of_infinity = 65'534, code_of_nan = 65'535;

/// Range of one sample's finite values; 0 and 0 when there are none.
struct FieldRange {
  float low = 0, high = 0;

  [[nodiscard]] double step() const noexcept { return (double{high} - double{low}) / last_code; }
};

/// Greatest error of a finite value: half a step, and the rounding to single precision.
[[nodiscard]] inline float largest_error(const FieldRange& range) noexcept {
  if (!(range.low < range.high)) return 0;
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float greatest = std::max(std::abs(range.low), std::abs(range.high));
  const double spacing = double{greatest} - double{std::nextafter(greatest, 0.0f)};
  return std::nextafter(static_cast<float>((range.step() + spacing) / 2), infinity);
}

/// Both ends are exact, and a decoded value is encoded to the same code again.
[[nodiscard]] inline float decoded(FieldCode code, const FieldRange& range) noexcept {
  if (code < last_code) return static_cast<float>(double{range.low} + range.step() * code);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const std::array<float, 4> special{range.high, -infinity, infinity, std::numeric_limits<float>::quiet_NaN()};
  return special[code - last_code];
}

inline void decode(std::span<const FieldCode> codes, const FieldRange& range, std::span<float> into) noexcept {
  for (std::size_t i = 0; i < codes.size(); ++i) into[i] = decoded(codes[i], range);
}

[[nodiscard]] inline FieldRange range_of_field(std::span<const float> values) noexcept {
  FieldRange range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  // + 0.0f: no -0, because its code decodes to 0.
  return range.low <= range.high ? FieldRange{range.low + 0.0f, range.high + 0.0f} : FieldRange{};
}

[[nodiscard]] inline FieldCode encoded(float value, const FieldRange& range) noexcept {
  if (std::isnan(value)) return code_of_nan;
  if (std::isinf(value)) return value > 0 ? code_of_infinity : code_of_minus_infinity;
  if (!(range.low < range.high)) return 0;
  const double steps = std::round((double{value} - double{range.low}) / range.step());
  return static_cast<FieldCode>(std::clamp(steps, 0.0, double{last_code}));
}
}  // namespace lbea
