#include "tools/bench/statistics.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace lbea::tool::bench {

// In whole numbers: 0.999 * 1000 is a little more than 999 in doubles, and rounds up to the wrong rank.
double percentile(std::span<const double> ascending, std::uint32_t per_mille) noexcept {
  const std::size_t rank = (ascending.size() * per_mille + 999) / 1000;
  return ascending[rank - 1];
}

Statistics statistics_of(std::span<const double> values) {
  if (values.empty()) return {};
  std::vector<double> ascending(values.begin(), values.end());
  std::ranges::sort(ascending);
  return {.count = values.size(),
          .p50 = percentile(ascending, 500),
          .p90 = percentile(ascending, 900),
          .p99 = percentile(ascending, 990),
          .p99_9 = percentile(ascending, 999),
          .max = ascending.back(),
          .mean = std::accumulate(ascending.begin(), ascending.end(), 0.0) / static_cast<double>(values.size())};
}

}  // namespace lbea::tool::bench
