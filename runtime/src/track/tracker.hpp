// How the tracker, the likeliest path and the inference weigh a frame's candidates.
#pragma once

#include "runtime/src/depth/image_comparison.hpp"

#include <lbea/tracker.hpp>

#include <algorithm>

namespace lbea {

/// Frames that a verdict of a test needs, and the probability from which on its branch is certain.
inline constexpr std::uint32_t frames_for_verdict = 4;
inline constexpr float certain_branch = 0.9f;

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

/// Whether a candidate is evidence: results of other programs may contain anything.
[[nodiscard]] inline bool is_usable(const Match& candidate, const Model& model) noexcept {
  return model.sample_index(candidate.sample) < model.samples() && std::isfinite(candidate.distance);
}

}  // namespace lbea
