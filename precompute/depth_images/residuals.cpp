#include "precompute/depth_images/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::bake {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Beyond this many standard deviations, estimated by the median absolute deviation.
double robust_limit(const std::vector<double>& values, double deviations) {
  constexpr double normal = 1.4826;  // standard deviations of a normal distribution per median absolute deviation
  const double center = median(values);
  std::vector<double> apart;
  for (const double value : values) apart.push_back(std::abs(value - center));
  return center + deviations * normal * median(apart);
}

}  // namespace

ExpectedResiduals::ExpectedResiduals(std::span<const LeftOut> answers) {
  std::uint32_t last = 0;
  for (const LeftOut& answer : answers) last = std::max(last, answer.sample.time_step);
  const std::size_t fewest = std::min<std::size_t>(5, answers.size());
  for (std::uint32_t step = 0; step <= last; ++step) {
    std::vector<double> near;
    for (std::uint32_t reach = 0; near.size() < fewest && reach <= last; ++reach) {
      near.clear();
      for (const LeftOut& answer : answers) {
        const std::uint32_t other = answer.sample.time_step;
        if (std::max(other, step) - std::min(other, step) <= reach) near.push_back(double{answer.mean_square});
      }
    }
    by_step_.push_back(near.empty() ? 0.0f : static_cast<float>(std::sqrt(median(near))));
  }
}

float ExpectedResiduals::at(std::uint32_t time_step) const {
  return by_step_.empty() ? 0.0f : by_step_[std::min<std::size_t>(time_step, by_step_.size() - 1)];
}

MisfitLimits misfit_limits(std::span<const LeftOut> answers, const ExpectedResiduals& expected, float mesh_noise) {
  constexpr double frame_deviations = 3, test_deviations = 3.2;
  constexpr double least = 1.2;
  constexpr std::size_t first_frames = 3;  // a mean over fewer is not reliable
  const double noise = double{mesh_noise} * double{mesh_noise};
  float greatest = 0;
  for (const LeftOut& answer : answers) greatest = std::max(greatest, expected.at(answer.sample.time_step));
  std::vector<double> misfits, means;
  double sum = 0, weights = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (i == 0 || answers[i].sample.simulation != answers[i - 1].sample.simulation) sum = weights = 0, count = 0;
    const float usual = expected.at(answers[i].sample.time_step);
    misfits.push_back(0.5 * std::log((double{answers[i].mean_square} + noise) / (square<double>(usual) + noise)));
    const double weight = misfit_weight(usual, greatest, mesh_noise);
    sum += weight * misfits.back();
    weights += weight;
    if (++count > first_frames) means.push_back(sum / weights);
  }
  MisfitLimits limits;
  if (misfits.size() < 8) return limits;
  limits.frame = static_cast<float>(std::max(std::exp(robust_limit(misfits, frame_deviations)), least));
  limits.test = means.size() < 8 ? limits.frame
                                 : static_cast<float>(std::max(std::exp(robust_limit(means, test_deviations)), least));
  return limits;
}

}  // namespace lbea::bake
