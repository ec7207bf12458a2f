// Random numbers as a function of (seed, pixel, purpose), independent of the order of the calls.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace lbea::bake {
/// The finalizer of splitmix64: a bijection that spreads every input bit.
[[nodiscard]] constexpr std::uint64_t splitmix(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Seed of frame `frame` of a recording made with `seed`.
[[nodiscard]] constexpr std::uint64_t frame_seed(std::uint64_t seed, std::uint64_t frame) noexcept {
  return splitmix(splitmix(seed) ^ frame);
}

enum class Draw : std::uint64_t { dropout, noise_radius, noise_angle, outlier, outlier_size, background };

class CounterRandom {
 public:
  CounterRandom(std::uint64_t seed, std::uint64_t pixel) noexcept : key_(splitmix(splitmix(seed) ^ pixel)) {}

  /// In [0, 1), 53 bits.
  [[nodiscard]] double uniform(Draw draw) const noexcept {
    return static_cast<double>(splitmix(key_ ^ static_cast<std::uint64_t>(draw)) >> 11) * 0x1p-53;
  }
  /// Standard normal, by Box and Muller.
  [[nodiscard]] double normal() const noexcept {
    const double radius = std::sqrt(-2 * std::log(1 - uniform(Draw::noise_radius)));
    return radius * std::cos(2 * std::numbers::pi * uniform(Draw::noise_angle));
  }

 private:
  std::uint64_t key_;
};
}  // namespace lbea::bake
