// How the tracker, the likeliest path and the inference weigh a frame's candidates.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <lbea/tracker.hpp>

#include <algorithm>

namespace lbea {

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

}  // namespace lbea
