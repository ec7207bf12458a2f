// Percentiles and means of measured times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace lbea::tool::bench {

/// Percentiles by the nearest-rank definition: the least measured value that at least that share of all values does
/// not exceed. Always a value that was measured, never one between two.
struct Statistics {
  std::size_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, p99_9 = 0, max = 0, mean = 0;
};

/// All zero when there are no values. The order of the values does not matter.
[[nodiscard]] Statistics statistics_of(std::span<const double> values);

/// The nearest-rank percentile of values in ascending order, at least one: `per_mille` from 1 to 1000.
[[nodiscard]] double percentile(std::span<const double> ascending, std::uint32_t per_mille) noexcept;

}  // namespace lbea::tool::bench
