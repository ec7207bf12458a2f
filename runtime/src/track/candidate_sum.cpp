#include "runtime/src/track/candidate_sum.hpp"

#include "runtime/src/numbers/elementary.hpp"

namespace lbea {

void CandidateSum::clear() noexcept {
  for (const std::uint32_t sample : candidates_) {
    gain_[sample] = 0;
    is_candidate_[sample] = false;
  }
  candidates_.clear();
}

void CandidateSum::add(const Model& model, std::span<const Match> candidates, const Likelihood& likelihood_of,
                       float worst) noexcept {
  const double of_others = likelihood_of(worst);
  for (const Match& candidate : candidates) {
    const std::uint32_t sample = model.sample_index(candidate.sample);
    gain_[sample] += logarithm(likelihood_of(candidate.distance) / of_others);
    if (is_candidate_[sample]) continue;
    is_candidate_[sample] = true;
    candidates_.push_back(sample);
  }
}

std::uint32_t CandidateSum::best() const noexcept {
  std::uint32_t best = candidates_.front();
  for (const std::uint32_t sample : candidates_)
    if (gain_[sample] > gain_[best] || (gain_[sample] == gain_[best] && sample < best)) best = sample;
  return best;
}

double CandidateSum::share(std::uint32_t sample) const noexcept {
  double all = 0;
  for (const std::uint32_t other : candidates_) all += exponential(gain_[other] - gain_[sample]);
  return 1 / all;
}

}  // namespace lbea
