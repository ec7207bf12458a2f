#include "runtime/src/depth/pose_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace lbea {

PoseMotion calibration_variances(const PoseCenter& center, double length_per_mm) noexcept {
  constexpr double turn_deg = 3, shift_mm = 10;  // standard deviations, per axis
  const double turn = center.arm * turn_deg * std::numbers::pi / 180, shift = shift_mm * length_per_mm;
  PoseMotion variances;
  for (std::size_t i = 0; i < 6; ++i) variances[i] = i < 3 ? turn * turn : shift * shift;
  return variances;
}

PoseFilter::PoseFilter(const PoseCenter& center, double length_per_mm, double duration_s,
                       double drift_evidence) noexcept
    : center_(center),
      tolerance_(0.25 * length_per_mm),
      duration_s_(duration_s),
      calibration_(calibration_variances(center, length_per_mm)),
      calibrated_(calibration_, drift_evidence > 0 ? drift_evidence : std::numeric_limits<double>::infinity()),
      test_(calibrated_) {}

void PoseFilter::reset() noexcept {
  test_ = calibrated_;
  moved_ = {};
  stamp_ns_.reset();
  unexplained_ = 0;
}

void PoseFilter::begin_frame(std::int64_t stamp_ns) noexcept {
  const double seconds = stamp_ns_ ? seconds_between(*stamp_ns_, stamp_ns) : 0;
  stamp_ns_ = stamp_ns;
  if (seconds > 0 && duration_s_ > 0) test_.advance(std::min(seconds / duration_s_, 1.0));
  moved_ = test_.likelier().motion();
  passes_ = 0;
  is_frozen_ = is_lost_ = false;
}

PoseBelief PoseFilter::prior() const noexcept {
  PoseBelief prior{test_.likelier().motion(), PoseFactor(test_.likelier().covariance()).inverse()};
  for (std::size_t i = 0; i < 6; ++i) prior.mean[i] -= moved_[i];
  return prior;
}

void PoseFilter::write(FitNumbers& numbers) const noexcept {
  const PoseMatrix covariance = test_.likelier().covariance();
  const double degrees = 180 / std::numbers::pi / center_.arm;
  const auto deviation = [&](std::size_t i) {
    return std::sqrt(covariance[7 * i] + covariance[7 * (i + 1)] + covariance[7 * (i + 2)]);
  };
  numbers.pose_turn = static_cast<float>(std::hypot(moved_[0], moved_[1], moved_[2]) * degrees);
  numbers.pose_shift = static_cast<float>(std::hypot(moved_[3], moved_[4], moved_[5]));
  numbers.pose_turn_sd = static_cast<float>(deviation(0) * degrees);
  numbers.pose_shift_sd = static_cast<float>(deviation(3));
}

bool PoseFilter::move(const PoseBelief& posterior, bool is_explained) noexcept {
  if (is_lost_ && is_explained) test_ = calibrated_;
  if (is_frozen_) return false;
  constexpr std::uint32_t most_unexplained = 5;  // frames in a row, each of which takes many passes
  if (!is_explained && unexplained_ >= most_unexplained) return go_back();
  PoseMeasurement measured = PoseMeasurement::between(prior(), posterior, calibration_);
  for (std::size_t i = 0; i < 6; ++i) measured.motion[i] += moved_[i];
  DriftTest updated = test_;
  updated.update(measured);
  const PoseMotion motion = updated.likelier().motion();
  double squared = 0, deviations = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    squared += (motion[i] - moved_[i]) * (motion[i] - moved_[i]);
    deviations += motion[i] * motion[i] / calibration_[i];
  }
  constexpr double most_deviations = 5;  // of the calibration: beyond, or if not finite, the frame is not understood
  if (!(deviations <= most_deviations * most_deviations)) return go_back();
  moved_ = motion;
  if (squared > tolerance_ * tolerance_ && ++passes_ < most_passes) return true;
  if (is_explained) {
    test_ = updated;
    unexplained_ = 0;
    return false;
  }
  ++unexplained_;
  return go_back();
}

bool PoseFilter::go_back() noexcept {
  is_frozen_ = true;
  const PoseMotion from = std::exchange(moved_, test_.likelier().motion());
  return from != moved_;
}

bool PoseFilter::retreat() noexcept {
  if (is_lost_) {
    moved_ = test_.likelier().motion();
    return false;
  }
  if (!is_frozen_ && go_back()) return true;
  is_lost_ = moved_ != PoseMotion{};
  moved_ = {};
  return is_lost_;
}

}  // namespace lbea
