// Sums and differences of times that others sent or recorded, which may be any numbers.
#pragma once

#include <cstdint>
#include <limits>

namespace lbea::tool {

/// `later` - `earlier` in ns, without overflow.
[[nodiscard]] constexpr double difference_ns(std::int64_t later, std::int64_t earlier) noexcept {
  const auto a = static_cast<std::uint64_t>(later), b = static_cast<std::uint64_t>(earlier);
  return later >= earlier ? static_cast<double>(a - b) : -static_cast<double>(b - a);
}

/// Their sum, or the limit that it would exceed.
[[nodiscard]] constexpr std::int64_t saturated_sum(std::int64_t a, std::int64_t b) noexcept {
  using Limits = std::numeric_limits<std::int64_t>;
  if (b > 0 && a > Limits::max() - b) return Limits::max();
  if (b < 0 && a < Limits::min() - b) return Limits::min();
  return a + b;
}

}  // namespace lbea::tool
