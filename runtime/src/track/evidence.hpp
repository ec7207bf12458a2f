// How likely a frame makes the samples, as the tracker and the path after the test weigh it.
#pragma once

#include <lbea/tracker.hpp>

#include <algorithm>
#include <cmath>

namespace lbea {

/// Plausibility of a candidate by its residual, against the best one's; never below `doubt`, because a single frame may
/// lie and must not rule out what all the others say.
class Plausibility {
 public:
  Plausibility(float least_residual, const TrackerConfig& config) noexcept
      : best_(square(least_residual)), scale_(best_ + square(config.noise)), sharpness_(double{config.sharpness}) {}
  [[nodiscard]] double operator()(float residual) const noexcept {
    constexpr double doubt = 1e-9;
    return std::max(std::exp(-sharpness_ * (square(residual) - best_) / scale_), doubt);
  }

 private:
  static double square(float v) noexcept { return double{v} * double{v}; }
  double best_, scale_, sharpness_;
};

}  // namespace lbea
