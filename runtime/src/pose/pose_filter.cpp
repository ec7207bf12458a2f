#include "runtime/src/pose/pose_filter.hpp"

#include "runtime/src/numbers/elementary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace lbea {

namespace {

// Of the errors: the correlation time, and the share of their variance that is independent.
constexpr double correlation_time = 0.2, independent = 0.1;
// Growth of the rate's standard deviation over one duration, in the units of usual_drift_rate.
constexpr double usual_change = 0.1;

double enough_evidence(const PoseErrors& errors) noexcept {
  return errors.drift_evidence > 0 ? errors.drift_evidence : std::numeric_limits<double>::infinity();
}

}  // namespace

PoseMeasurement PoseMeasurement::between(const PoseBelief& prior, const PoseBelief& posterior,
                                         const PoseMotion& calibration) noexcept {
  constexpr double least = 1e-6;  // of the calibration's information, and of the posterior's, which is rounded
  PoseMatrix information{};
  PoseMeasurement measured;
  for (std::size_t i = 0; i < 36; ++i) {
    information[i] = posterior.information[i] - prior.information[i] +
                     (i % 7 == 0 ? least * (posterior.information[i] + 1 / calibration[i / 7]) : 0);
    measured.motion[i / 6] +=
        posterior.information[i] * posterior.mean[i % 6] - prior.information[i] * prior.mean[i % 6];
  }
  const PoseFactor factor(information);
  measured.motion = factor.solve(measured.motion);
  measured.covariance = factor.inverse();
  return measured;
}

PoseMatrix PoseMeasurement::covariance_with(const PoseMatrix& spread) const noexcept {
  const PoseFactor frame(covariance), learned(spread);
  PoseMatrix factor{}, product{};  // both lower triangular
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      for (std::size_t k = j; k <= i; ++k) factor[6 * i + j] += frame(i, k) * learned(k, j);
  for (std::size_t i = 0; i < 36; ++i)
    for (std::size_t k = 0; k < 6; ++k) product[i] += factor[i / 6 * 6 + k] * factor[i % 6 * 6 + k];
  return product;
}

PoseMeasurement PoseMeasurement::together_with(const PoseMeasurement& other) const noexcept {
  const PoseMatrix own = PoseFactor(covariance).inverse(), of_other = PoseFactor(other.covariance).inverse();
  PoseMatrix information{};
  PoseMotion sum{};
  for (std::size_t i = 0; i < 36; ++i) {
    information[i] = own[i] + of_other[i];
    sum[i / 6] += own[i] * motion[i % 6] + of_other[i] * other.motion[i % 6];
  }
  const PoseFactor factor(information);
  return {factor.solve(sum), factor.inverse()};
}

PoseTrajectory::PoseTrajectory(const PoseMotion& calibration) noexcept : calibration_(calibration) {
  for (std::size_t i = 0; i < 6; ++i) {
    at(i, i) = calibration[i];
    at(error + i, error + i) = 1;
  }
}

PoseTrajectory PoseTrajectory::drifting() const noexcept {
  PoseTrajectory result = *this;
  for (std::size_t i = rate; i < error; ++i) {
    result.mean_[i] = 0;
    for (std::size_t j = 0; j < n; ++j) result.at(i, j) = result.at(j, i) = 0;
    result.at(i, i) = usual_drift_rate * usual_drift_rate * calibration_[i - rate];
  }
  return result;
}

void PoseTrajectory::advance(double elapsed) noexcept {
  const double kept = exponential(-elapsed / correlation_time);
  for (std::size_t i = 0; i < 6; ++i) {
    mean_[i] += elapsed * mean_[rate + i];
    mean_[error + i] *= kept;
    for (std::size_t j = 0; j < n; ++j) {
      at(i, j) += elapsed * at(rate + i, j);
      at(error + i, j) *= kept;
    }
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      at(i, j) += elapsed * at(i, rate + j);
      at(i, error + j) *= kept;
    }
  for (std::size_t i = 0; i < 6; ++i) {
    at(error + i, error + i) += 1 - kept * kept;
    if (!(at(rate + i, rate + i) > 0)) continue;                                    // constant
    const double change = usual_change * usual_change * calibration_[i] * elapsed;  // white acceleration
    at(i, i) += change * elapsed * elapsed / 3;
    at(i, rate + i) += change * elapsed / 2;
    at(rate + i, i) += change * elapsed / 2;
    at(rate + i, rate + i) += change;
  }
}

double PoseTrajectory::update(const PoseMeasurement& measured) noexcept {
  const PoseFactor deviation(measured.covariance);
  const double correlated = std::sqrt(1 - independent);
  const auto H = [&](std::size_t i, std::size_t j) { return correlated * deviation(i, j); };  // of the errors
  std::array<PoseMotion, n> predicted{};  // per state, its covariance with what is measured
  for (std::size_t s = 0; s < n; ++s)
    for (std::size_t i = 0; i < 6; ++i) {
      predicted[s][i] = at(s, i);
      for (std::size_t j = 0; j <= i; ++j) predicted[s][i] += H(i, j) * at(s, error + j);
    }
  PoseMatrix expected{};  // covariance of what is measured
  PoseMotion innovation = measured.motion;
  for (std::size_t i = 0; i < 6; ++i) {
    innovation[i] -= mean_[i];
    for (std::size_t j = 0; j <= i; ++j) innovation[i] -= H(i, j) * mean_[error + j];
    for (std::size_t j = 0; j < 6; ++j) {
      double sum = predicted[i][j] + independent * measured.covariance[6 * i + j];
      for (std::size_t k = 0; k <= i; ++k) sum += H(i, k) * predicted[error + k][j];
      expected[6 * i + j] = sum;
    }
  }
  const PoseFactor factor(expected);
  innovation = factor.forward(innovation);
  for (PoseMotion& of_state : predicted) of_state = factor.forward(of_state);
  double likelihood = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    likelihood -= innovation[i] * innovation[i] / 2 + logarithm(factor(i, i));
    for (std::size_t s = 0; s < n; ++s) {
      mean_[s] += predicted[s][i] * innovation[i];
      for (std::size_t t = 0; t < n; ++t) at(s, t) -= predicted[s][i] * predicted[t][i];
    }
  }
  return likelihood;
}

PoseMotion PoseTrajectory::motion() const noexcept {
  PoseMotion motion;
  std::copy_n(mean_.begin(), motion.size(), motion.begin());
  return motion;
}

PoseMatrix PoseTrajectory::covariance() const noexcept {
  PoseMatrix covariance;
  for (std::size_t i = 0; i < 6; ++i) std::copy_n(&covariance_[n * i], 6, &covariance[6 * i]);
  return covariance;
}

DriftTest::DriftTest(const PoseMotion& calibration, double enough) noexcept
    : constant_(calibration), drifting_(constant_.drifting()), enough_(enough) {}

void DriftTest::advance(double elapsed) noexcept {
  constant_.advance(elapsed);
  drifting_.advance(elapsed);
}

void DriftTest::update(const PoseMeasurement& measured, bool is_evidence) noexcept {
  constexpr double most = 4;  // of one frame, which may be an outlier
  const double of_frame = std::min(drifting_.update(measured) - constant_.update(measured), most);
  if (is_evidence) evidence_ += of_frame;
  is_drifting_ = is_drifting_ || evidence_ > enough_;
  if (is_drifting_ || evidence_ > 0) return;
  evidence_ = 0;
  drifting_ = constant_.drifting();
}

PoseMotion calibration_variances(const PoseCenter& center, double length_per_mm) noexcept {
  constexpr double turn_deg = 3, shift_mm = 10;  // standard deviations, per axis
  const double turn = center.arm * turn_deg * std::numbers::pi / 180, shift = shift_mm * length_per_mm;
  PoseMotion variances;
  for (std::size_t i = 0; i < 6; ++i) variances[i] = i < 3 ? turn * turn : shift * shift;
  return variances;
}

PoseFilter::PoseFilter(const PoseCenter& center, double length_per_mm, double duration_s, const PoseErrors& by_image,
                       const std::optional<PoseErrors>& by_points) noexcept
    : center_(center),
      tolerance_(0.25 * length_per_mm),
      noise_(length_per_mm),
      duration_s_(duration_s),
      spreads_(by_image.spreads),
      by_points_(by_points ? std::optional(by_points->spreads) : std::nullopt),
      calibration_(calibration_variances(center, length_per_mm)),
      calibrated_(calibration_, enough_evidence(by_points.value_or(by_image))),
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
  least_squared_ = std::numeric_limits<double>::infinity();
  passes_ = 0;
  is_settled_ = is_frozen_ = is_lost_ = false;
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

PoseMeasurement PoseFilter::measured(const PoseBelief& posterior, double time_s,
                                     const std::optional<PoseMeasurement>& by_points) const noexcept {
  const double time = duration_s_ > 0 ? time_s / duration_s_ : 0;
  PoseMeasurement measured = PoseMeasurement::between(prior(), posterior, calibration_);
  measured.covariance = measured.covariance_with(spreads_.at(time));
  if (by_points && by_points_)
    measured = measured.together_with({by_points->motion, by_points->covariance_with(by_points_->at(time))});
  for (std::size_t i = 0; i < 6; ++i) measured.motion[i] += moved_[i];
  return measured;
}

bool PoseFilter::is_worse(float residual) noexcept {
  constexpr double clearly = 1.2;  // of squares
  const double squared = double{residual} * double{residual};
  if (squared + noise_ * noise_ > clearly * (least_squared_ + noise_ * noise_)) return true;
  if (squared < least_squared_) best_ = moved_;
  least_squared_ = std::min(least_squared_, squared);
  return false;
}

bool PoseFilter::move(const PoseBelief& posterior, bool is_explained, double time_s,
                      const std::optional<PoseMeasurement>& by_points, std::optional<float> hidden_residual) noexcept {
  if (is_lost_ && is_explained) test_ = calibrated_;
  if (is_frozen_) return false;
  constexpr std::uint32_t most_unexplained = 5;  // frames in a row, each of which takes many passes
  if (!is_explained && unexplained_ >= most_unexplained) return go_back();
  if (!is_settled_ && hidden_residual && is_worse(*hidden_residual)) {
    moved_ = best_;
    is_settled_ = true;
    return true;
  }
  DriftTest updated = test_;
  updated.update(measured(posterior, time_s, by_points), by_points.has_value() == by_points_.has_value());
  const PoseMotion motion = updated.likelier().motion();
  double squared = 0, deviations = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    squared += (motion[i] - moved_[i]) * (motion[i] - moved_[i]);
    deviations += motion[i] * motion[i] / calibration_[i];
  }
  constexpr double most_deviations = 5;  // of the calibration: beyond, or if not finite, the frame is not understood
  if (!(deviations <= most_deviations * most_deviations)) return go_back();
  if (!is_settled_) moved_ = motion;
  if (!is_settled_ && squared > tolerance_ * tolerance_ && ++passes_ < most_passes) return true;
  if (is_explained) {
    test_ = updated;
    unexplained_ = 0;
    return false;
  }
  ++unexplained_;
  return go_back();
}

void PoseFilter::reconsider(const PoseFilter& before) noexcept {
  PoseFilter without = before;
  if (stamp_ns_) without.begin_frame(*stamp_ns_);
  test_ = without.test_;
  unexplained_ = without.unexplained_;
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
