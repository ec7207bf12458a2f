#include "precompute/depth_images/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

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

std::uint32_t step_of(const LeftOut& answer) { return answer.sample.time_step; }

}  // namespace

ExpectedResiduals::ExpectedResiduals(std::span<const LeftOut> answers) : answers_(answers.begin(), answers.end()) {
  std::ranges::stable_sort(answers_, {}, step_of);
}

float ExpectedResiduals::at(std::uint32_t time_step) const {
  if (answers_.empty()) return 0;
  const auto apart = [time_step](const LeftOut& answer) {
    return std::max(step_of(answer), time_step) - std::min(step_of(answer), time_step);
  };
  auto first = std::ranges::lower_bound(answers_, time_step, {}, step_of), end = first;
  std::uint32_t reach = 0;  // time steps, to the fifth nearest answer
  for (std::size_t near = 0; near < std::min<std::size_t>(5, answers_.size()); ++near) {
    const bool is_later =
        first == answers_.begin() || (end != answers_.end() && apart(*end) < apart(*std::prev(first)));
    reach = apart(is_later ? *end++ : *--first);
  }
  while (first != answers_.begin() && apart(*std::prev(first)) <= reach) --first;
  while (end != answers_.end() && apart(*end) <= reach) ++end;
  std::vector<double> near;
  std::transform(first, end, std::back_inserter(near),
                 [](const LeftOut& answer) { return double{answer.mean_square}; });
  return static_cast<float>(std::sqrt(median(std::move(near))));
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
