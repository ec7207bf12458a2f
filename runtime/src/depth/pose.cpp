#include "runtime/src/depth/pose.hpp"

#include "runtime/src/depth/depth_images.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lbea {

PoseCenter PoseCenter::of(const ModelView& model) {
  PoseCenter center;
  const auto positions = model.node_positions.first(std::size_t{3} * model.info.nodes);
  for (std::size_t i = 0; i < positions.size(); ++i) center.middle[i % 3] += double{positions[i]} / model.info.nodes;
  double squared = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double offset = double{positions[i]} - center.middle[i % 3];
    squared += offset * offset / model.info.nodes;
  }
  center.arm = squared > 0 ? std::sqrt(squared) : 1;
  return center;
}

/// Rodrigues' formula: R = I + sin a K + (1 - cos a) K K, with K = [axis]x.
RigidTransform transform_of(const PoseMotion& motion, const PoseCenter& center) noexcept {
  const double angle = std::hypot(motion[0], motion[1], motion[2]) / center.arm;
  std::array<double, 3> axis{};
  for (std::size_t i = 0; i < 3; ++i) axis[i] = angle > 0 ? motion[i] / center.arm / angle : 0;
  const std::array<double, 9> K{0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
  RigidTransform T{};
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = center.middle[i] + motion[3 + i];
    for (std::size_t j = 0; j < 3; ++j) {
      double squared = 0;
      for (std::size_t k = 0; k < 3; ++k) squared += K[3 * i + k] * K[3 * k + j];
      const double r = (i == j ? 1 : 0) + std::sin(angle) * K[3 * i + j] + (1 - std::cos(angle)) * squared;
      T[4 * i + j] = static_cast<float>(r);
      shift -= r * center.middle[j];
    }
    T[4 * i + 3] = static_cast<float>(shift);
  }
  return T;
}

RigidTransform product(const RigidTransform& a, const RigidTransform& b) noexcept {
  RigidTransform T{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      double sum = j == 3 ? double{a[4 * i + 3]} : 0;
      for (std::size_t k = 0; k < 3; ++k) sum += double{a[4 * i + k]} * double{b[4 * k + j]};
      T[4 * i + j] = static_cast<float>(sum);
    }
  return T;
}

PoseFactor::PoseFactor(const PoseMatrix& matrix) noexcept {
  constexpr double least = 1e-12;  // of a diagonal entry, which rounding may make negative
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix[6 * i + j];
      for (std::size_t k = 0; k < j; ++k) sum -= lower_[6 * i + k] * lower_[6 * j + k];
      const double smallest = least * matrix[7 * i] + std::numeric_limits<double>::min();
      lower_[6 * i + j] = i == j ? std::sqrt(std::max(sum, smallest)) : sum / lower_[7 * j];
    }
}

PoseMotion PoseFactor::forward(PoseMotion b) const noexcept {
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < i; ++j) b[i] -= lower_[6 * i + j] * b[j];
    b[i] /= lower_[7 * i];
  }
  return b;
}

PoseMotion PoseFactor::backward(PoseMotion b) const noexcept {
  for (std::size_t i = 6; i-- > 0;) {
    for (std::size_t j = i + 1; j < 6; ++j) b[i] -= lower_[6 * j + i] * b[j];
    b[i] /= lower_[7 * i];
  }
  return b;
}

namespace {

PoseMotion operator*(const PoseMatrix& matrix, const PoseMotion& motion) noexcept {
  PoseMotion result{};
  for (std::size_t i = 0; i < 36; ++i) result[i / 6] += matrix[i] * motion[i % 6];
  return result;
}

/// A run that is not in the ensemble seems moved in the same way in all its frames: their errors are not independent.
/// So a frame that says less than those before is discounted by the ratio of the informations.
PoseBelief discounted(const PoseBelief& prior, const PoseBelief& posterior) noexcept {
  double before = 0, added = 0;
  for (std::size_t i = 0; i < 36; i += 7) {
    before += prior.information[i];
    added += posterior.information[i] - prior.information[i];
  }
  if (!(added > 0)) return prior;
  const double share = added / (added + before);
  PoseBelief result = prior;
  const PoseMotion of_prior = prior.information * prior.mean, of_both = posterior.information * posterior.mean;
  for (std::size_t i = 0; i < 36; ++i)
    result.information[i] += share * (posterior.information[i] - prior.information[i]);
  for (std::size_t i = 0; i < 6; ++i) result.mean[i] = of_prior[i] + share * (of_both[i] - of_prior[i]);
  const PoseFactor factor(result.information);
  result.mean = factor.backward(factor.forward(result.mean));
  return result;
}

}  // namespace

PoseFilter::PoseFilter(const PoseCenter& center, double length_per_mm) noexcept
    : center_(center), tolerance_(0.25 * length_per_mm) {
  constexpr double turn_deg = 3, shift_mm = 10;  // standard deviations of a rough calibration, per axis
  const double turn = center.arm * turn_deg * std::numbers::pi / 180, shift = shift_mm * length_per_mm;
  for (std::size_t i = 0; i < 6; ++i) calibration_[7 * i] = 1 / (i < 3 ? turn * turn : shift * shift);
  reset();
}

void PoseFilter::reset() noexcept {
  belief_ = {.information = calibration_};
  begin_frame();
}

void PoseFilter::begin_frame() noexcept {
  moved_ = belief_.mean;
  passes_ = 0;
  is_frozen_ = false;
}

bool PoseFilter::retreat() noexcept {
  if (moved_ == belief_.mean && moved_ == PoseMotion{}) return false;
  if (moved_ == belief_.mean) belief_ = {.information = calibration_};
  moved_ = belief_.mean;
  is_frozen_ = true;
  return true;
}

PoseBelief PoseFilter::prior() const noexcept {
  PoseBelief prior = belief_;
  for (std::size_t i = 0; i < 6; ++i) prior.mean[i] -= moved_[i];
  return prior;
}

float PoseFilter::turn_deg() const noexcept {
  return static_cast<float>(std::hypot(moved_[0], moved_[1], moved_[2]) / center_.arm * 180 / std::numbers::pi);
}

float PoseFilter::shift() const noexcept { return static_cast<float>(std::hypot(moved_[3], moved_[4], moved_[5])); }

bool PoseFilter::move(const PoseBelief& posterior) noexcept {
  if (is_frozen_) return false;
  const PoseBelief belief = discounted(prior(), posterior);
  double squared = 0, deviations = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    moved_[i] += belief.mean[i];
    squared += belief.mean[i] * belief.mean[i];
    deviations += moved_[i] * moved_[i] * calibration_[7 * i];
  }
  constexpr double most_deviations = 5;  // of the calibration: beyond, or if not finite, the frame is not understood
  if (!(deviations <= most_deviations * most_deviations)) return retreat();
  if (squared > tolerance_ * tolerance_ && ++passes_ < most_passes) return true;
  belief_ = {moved_, belief.information};
  return false;
}

TestPose::TestPose(const Model& model, const SensorViews& views) {
  const SensorViews used = views.empty() ? SensorViews::baked_into(model) : views;
  state_ = std::make_unique<State>(State{PoseFilter(PoseCenter::of(model.view()), units_per_mm(model.length_unit())),
                                         !used.empty() && used.data()->pose_variance > 0});
}
TestPose::~TestPose() = default;
TestPose::TestPose(TestPose&&) noexcept = default;
TestPose& TestPose::operator=(TestPose&&) noexcept = default;
bool TestPose::is_estimated() const noexcept { return state_->is_estimated; }
RigidTransform TestPose::correction() const noexcept { return state_->filter.transform(); }
void TestPose::reset() noexcept { state_->filter.reset(); }

}  // namespace lbea
