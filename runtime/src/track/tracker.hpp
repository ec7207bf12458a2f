// How the tracker, the likeliest path and the inference weigh a frame's candidates.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <lbea/tracker.hpp>

#include <algorithm>

namespace lbea {

/// The configuration with the default of `noise` in this unit.
[[nodiscard]] inline TrackerConfig completed(TrackerConfig config, std::string_view length_unit) noexcept {
  constexpr double noise_mm = 0.5;
  if (!(config.noise > 0)) config.noise = static_cast<float>(noise_mm * units_per_mm(length_unit));
  return config;
}
[[nodiscard]] inline TrackerConfig completed(const TrackerConfig& config, const Model& model) noexcept {
  return completed(config, model.length_unit());
}

/// Likelihood of a candidate by its residual: its plausibility, but at least `doubt`, so that a single wrong frame
/// cannot exclude what all others support.
class Likelihood {
 public:
  Likelihood(float least_residual, const TrackerConfig& config) noexcept
      : plausibility_(least_residual, config.noise, config.sharpness) {}
  [[nodiscard]] double operator()(float residual) const noexcept {
    constexpr double doubt = 1e-9;
    return std::max(plausibility_(residual), doubt);
  }

 private:
  Plausibility<double> plausibility_;
};

/// How badly each simulation explains frames: the excess of its best candidate's squared rank over the least of the
/// frame, relative to the latter. Ranks are the distances of the candidates.
class History {
 public:
  History(std::size_t simulations, float noise)
      : excess_(simulations), best_(simulations), squared_noise_(square<double>(noise)) {}
  void reset() noexcept {
    std::ranges::fill(excess_, 0.0);
    weights_ = 0;
  }
  void add(std::span<const Match> ranked) noexcept {
    const auto [least, most] = std::ranges::minmax(ranked, {}, &Match::distance);
    std::ranges::fill(best_, square<double>(most.distance));  // of a simulation without a candidate
    for (const Match& m : ranked)
      best_[m.sample.simulation] = std::min(best_[m.sample.simulation], square<double>(m.distance));
    weights_ = decay * weights_ + 1;
    for (std::size_t s = 0; s < excess_.size(); ++s)
      excess_[s] = decay * excess_[s] +
                   (best_[s] - square<double>(least.distance)) / (square<double>(least.distance) + squared_noise_);
  }
  /// The mean over the frames, the last one with weight 1.
  [[nodiscard]] double operator[](std::uint32_t simulation) const noexcept {
    return weights_ > 0 ? excess_[simulation] / weights_ : 0;
  }

 private:
  static constexpr double decay = 0.7;  // per frame
  std::vector<double> excess_, best_;
  double squared_noise_, weights_ = 0;
};

}  // namespace lbea
