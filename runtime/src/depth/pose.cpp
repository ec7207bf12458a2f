#include "runtime/src/depth/pose.hpp"

#include "runtime/src/numbers/elementary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Rodrigues' formula: R = I + sin a K + (1 - cos a) K K, with K = [axis]x and 1 - cos a = 2 sin^2 (a / 2).
RigidTransform transform_of(const PoseMotion& motion, const PoseCenter& center) noexcept {
  const double angle = std::hypot(motion[0], motion[1], motion[2]) / center.arm;
  const double sin_a = sine(angle), sin_half_a = sine(angle / 2);
  std::array<double, 3> axis{};
  for (std::size_t i = 0; i < 3; ++i) axis[i] = angle > 0 ? motion[i] / center.arm / angle : 0;
  const std::array<double, 9> K{0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
  RigidTransform T{};
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = center.middle[i] + motion[3 + i];
    for (std::size_t j = 0; j < 3; ++j) {
      double squared = 0;
      for (std::size_t k = 0; k < 3; ++k) squared += K[3 * i + k] * K[3 * k + j];
      const double r = (i == j ? 1 : 0) + sin_a * K[3 * i + j] + 2 * sin_half_a * sin_half_a * squared;
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

PoseMatrix PoseSpreads::at(double time) const noexcept {
  const double place = time > 0 ? std::min(time, 1.0) * (times - 1) : 0;
  const auto before = std::min(static_cast<std::size_t>(place), times - 2);
  const double later = place - static_cast<double>(before);
  PoseMatrix spread;
  for (std::size_t i = 0; i < 36; ++i) spread[i] = (1 - later) * at_times[before][i] + later * at_times[before + 1][i];
  return spread;
}

PoseMatrix PoseFactor::inverse() const noexcept {
  PoseMatrix inverted;
  for (std::size_t i = 0; i < 6; ++i) {
    PoseMotion unit{};
    unit[i] = 1;
    std::ranges::copy(solve(unit), &inverted[6 * i]);
  }
  return inverted;
}

}  // namespace lbea
