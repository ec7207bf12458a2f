#include "runtime/src/fit/surface_pose.hpp"

namespace lbea {
namespace {

/// The weights of the samples, and the length that the points lack before edges.
std::size_t most_unknowns(const FitSettings& settings) { return settings.most_combined() + std::size_t{1}; }

}  // namespace

[[gnu::cold]]  // compiled for size
SurfacePose::SurfacePose(const PoseCenter& center, float mesh_noise, std::size_t stride, const FitSettings& settings)
    : code_(kernels()),
      center_(center),
      noise_(mesh_noise / 3),
      price_(settings.prices.correction),
      strip_(settings.correction_strip * mesh_noise),
      stride_(stride),
      roots_(stride),
      rows_(most_unknowns(settings) * stride),
      motions_(6 * stride),
      distances_(stride),
      gram_(most_unknowns(settings) * most_unknowns(settings)),
      sums_(most_unknowns(settings)),
      products_(7 * most_unknowns(settings)),
      solved_(products_.size()),
      ridge_(most_unknowns(settings)) {}

PoseMeasurement SurfacePose::measure(const SurfaceEquations& equations, const PoseMotion& calibration) noexcept {
  samples_ = equations.samples;
  unknowns_ = samples_ + 1;
  const auto [normals, squares] = weigh(equations);
  set_motions(equations);
  add_products();
  const auto measured = static_cast<float>(equations.measured), nodes = static_cast<float>(equations.nodes);
  const double variance = double{squares / measured} + double{square(noise_)};
  constexpr double least = 1e-3, rounding = 1e-5;  // of the calibration's information; of the sums
  PoseMotion bounds{};
  for (std::size_t m = 0; m < 6; ++m) bounds[m] = least / calibration[m] + rounding * information_[7 * m] / variance;
  eliminate_weights(price_ * nodes * equations.squares * normals / measured);
  for (double& entry : information_) entry /= variance;
  for (std::size_t m = 0; m < 6; ++m) {
    sum_[m] /= variance;
    information_[7 * m] += bounds[m];
  }
  const PoseFactor factor(information_);
  return {factor.solve(sum_), factor.inverse()};
}

/// Multiplies the equations by the roots of their weights: the variance of the points over that of points and samples.
SurfacePose::Sums SurfacePose::weigh(const SurfaceEquations& equations) noexcept {
  std::ranges::fill(roots_, 0.0f);
  for (std::size_t s = 0; s < samples_; ++s)
    for (std::size_t i = 0; i < stride_; ++i) roots_[i] += square(equations.rows[s * stride_ + i]);
  Sums sums;
  for (std::size_t i = 0; i < stride_; ++i) {
    roots_[i] = noise_ / std::sqrt(square(noise_) + roots_[i] / static_cast<float>(samples_));
    distances_[i] = roots_[i] * equations.distances[i];
    sums.squares += square(distances_[i]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      sums.normals += square(roots_[i] * equations.directions[axis * stride_ + i]);
  }
  for (std::size_t s = 0; s < samples_; ++s)
    for (std::size_t i = 0; i < stride_; ++i) rows_[s * stride_ + i] = roots_[i] * equations.rows[s * stride_ + i];
  for (std::size_t i = 0; i < stride_; ++i)
    rows_[samples_ * stride_ + i] = strip_ * roots_[i] * equations.directions[3 * stride_ + i];
  return sums;
}

/// The distances change against the motion that the cloud lacks: -n . (w x p / arm + v), p from the middle.
void SurfacePose::set_motions(const SurfaceEquations& equations) noexcept {
  const auto arm = static_cast<float>(center_.arm);
  for (std::size_t i = 0; i < stride_; ++i) {
    auto n = vector_at(equations.directions, stride_, i), p = vector_at(equations.shape, stride_, i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      n[axis] *= -roots_[i];
      p[axis] = (p[axis] - static_cast<float>(center_.middle[axis])) / arm;
    }
    const float along[] = {
        p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2], p[0] * n[1] - p[1] * n[0], n[0], n[1], n[2]};
    for (std::size_t m = 0; m < 6; ++m) motions_[m * stride_ + i] = along[m];
  }
}

/// Of the samples with each other, with the motions, and with the distances; of the motions with both.
void SurfacePose::add_products() noexcept {
  const std::size_t k = unknowns_;
  std::fill_n(gram_.begin(), k * k, 0.0f);
  lbea::add_products(code_, rows_.data(), k, stride_, 1, sums_, gram_);
  std::array<float, 7> of_motion{};
  for (std::size_t m = 0; m < 7; ++m) {
    const float* const one = m < 6 ? &motions_[m * stride_] : distances_.data();
    code_.project(rows_.data(), k, stride_, one, &products_[m * k]);
    code_.project(motions_.data(), 6, stride_, one, of_motion.data());
    for (std::size_t n = 0; n < 6; ++n) (m < 6 ? information_[6 * m + n] : sum_[n]) = double{of_motion[n]};
  }
}

/// What the unknowns explain, at this price P, is no motion: M'M - M'R (R'R + P)^-1 R'M.
void SurfacePose::eliminate_weights(float price) noexcept {
  const auto prices = std::span(sums_).first(unknowns_);
  std::ranges::fill(prices, std::max(price, std::numeric_limits<float>::min()));
  ridge_.factorize(gram_, unknowns_, prices);
  for (std::size_t m = 0; m < 7; ++m) {
    std::copy_n(&products_[m * unknowns_], unknowns_, solved(m).begin());
    ridge_.substitute(solved(m));
  }
  for (std::size_t m = 0; m < 6; ++m)
    for (std::size_t i = 0; i < unknowns_; ++i) {
      const double product = double{products_[m * unknowns_ + i]};
      for (std::size_t n = 0; n < 6; ++n) information_[6 * m + n] -= product * solved(n)[i];
      sum_[m] -= product * solved(6)[i];
    }
}

}  // namespace lbea
