// How long things took, as counts between fixed bounds; written by one thread and read by any.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

namespace lbea::tool {

class LatencyHistogram {
 public:
  /// Upper bounds in s; the last bucket has none.
  static constexpr std::array<double, 13> bounds_s{5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3,
                                                   1e-2, 2e-2, 5e-2, 0.1,  0.5,  1};
  using Counts = std::array<std::uint64_t, bounds_s.size() + 1>;

  void note(std::uint64_t ns) noexcept {
    std::size_t bucket = 0;
    while (bucket < bounds_s.size() && static_cast<double>(ns) * 1e-9 > bounds_s[bucket]) ++bucket;
    counts_[bucket].fetch_add(1, std::memory_order_relaxed);
    sum_ns_.fetch_add(ns, std::memory_order_relaxed);
  }
  [[nodiscard]] Counts counts() const noexcept {
    Counts counts;
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = counts_[i].load(std::memory_order_relaxed);
    return counts;
  }
  [[nodiscard]] double sum_s() const noexcept {
    return static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) * 1e-9;
  }

 private:
  std::array<std::atomic<std::uint64_t>, bounds_s.size() + 1> counts_{};
  std::atomic<std::uint64_t> sum_ns_{0};
};

}  // namespace lbea::tool
