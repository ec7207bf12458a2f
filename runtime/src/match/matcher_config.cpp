#include "runtime/src/match/matcher_config.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace lbea {
namespace {

constexpr std::uint32_t most_points = 1u << 28;

void require(bool holds, const std::string& sentence) {
  if (!holds) throw Error(Status::bad_config, "matcher configuration: " + sentence);
}

// R' R = 1 and det R = 1 within what a printed calibration file loses.
bool is_rigid(const RigidTransform& T) noexcept {
  constexpr double tolerance = 1e-3;
  const auto row = [&T](std::size_t i, std::size_t k) { return static_cast<double>(T[4 * i + k]); };
  if (!std::ranges::all_of(T, [](float v) { return std::isfinite(v); })) return false;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += row(i, k) * row(j, k);
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > tolerance) return false;
    }
  const double det = row(0, 0) * (row(1, 1) * row(2, 2) - row(1, 2) * row(2, 1)) -
                     row(0, 1) * (row(1, 0) * row(2, 2) - row(1, 2) * row(2, 0)) +
                     row(0, 2) * (row(1, 0) * row(2, 1) - row(1, 1) * row(2, 0));
  return det > 0;
}

}  // namespace

void check(const MatcherConfig& config, const ModelView& model, const SensorViews& views) {
  require(config.max_points >= 1 && config.max_points <= most_points,
          "max_points is " + std::to_string(config.max_points) + "; give 1 to " + std::to_string(most_points));
  require(config.max_matches >= 1, "max_matches is 0; give at least 1");
  require(config.trusted_distance > 0 && std::isfinite(config.trusted_distance),
          "trusted_distance is " + std::to_string(config.trusted_distance) + "; give a positive length");
  require(config.min_coverage >= 0 && config.min_coverage <= 1,
          "min_coverage is " + std::to_string(config.min_coverage) + "; give a share from 0 to 1");
  require(config.method == Method::lbea || config.method == Method::vtp || config.method == Method::fit,
          "unknown method; give lbea, vtp or fit");
  require(
      config.method != Method::fit || !views.empty(),
      "the model was baked without a sensor, so there are no depth images to compare with; bake it with one, render "
      "them for the sensor's pose, or match by lbea");
  require(views.empty() || views.data()->expected.size() == model.info.samples,
          "the depth images are those of another model");
  require(config.method != Method::vtp ||
              std::ranges::none_of(model.references, [](const ReferenceView& r) { return r.correspondence.empty(); }),
          "the model was baked without the samples' correspondences; bake it with them or match by lbea");
  require(is_rigid(config.T_reference_sensor),
          "T_reference_sensor is not a rigid transform; its left 3x3 part must be a rotation (no scale, no mirror)");
}

std::uint32_t reference_at(const ModelView& model, double time) noexcept {
  const auto times = model.reference_times;
  const auto later = std::ranges::lower_bound(times, time);
  if (later == times.begin()) return 0;
  const auto earlier = later - 1;
  const bool later_is_nearer = later != times.end() && *later - time < time - *earlier;
  return static_cast<std::uint32_t>((later_is_nearer ? later : earlier) - times.begin());
}

}  // namespace lbea
