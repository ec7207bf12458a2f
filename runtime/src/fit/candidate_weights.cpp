#include "runtime/src/fit/candidate_weights.hpp"

namespace lbea {

[[gnu::cold]]  // compiled for size
CandidateWeights::CandidateWeights(const ModelView& model, std::size_t most, std::uint32_t max_matches, float noise,
                                   const FitSettings& settings)
    : model_(model),
      settings_(settings),
      noise_(noise),
      by_rank_(std::min<std::uint32_t>(max_matches, static_cast<std::uint32_t>(most))),
      matched_(by_rank_.capacity()),
      ranks_(most),
      plausibility_(most) {}

void CandidateWeights::weigh(const EstimateProblem& problem, std::span<const float> alone,
                             const ShapeEstimate& estimate, SurfaceFit& result) noexcept {
  problem_ = problem;
  best_alone_ = static_cast<std::size_t>(std::ranges::min_element(alone) - alone.begin());
  rank(estimate.from_estimate(), settings_.residual_rank, result);
  set_spread(alone, estimate, result);
  set_plausibilities();
}

void CandidateWeights::rank(std::span<const float> from_estimate, float residual_rank, SurfaceFit& result) noexcept {
  by_rank_.clear();
  for (std::uint32_t i = 0; i < from_estimate.size(); ++i) {
    const float squared = square(from_estimate[i]) + residual_rank * square(problem_.candidates[i].distance);
    ranks_[i] = std::sqrt(squared);
    by_rank_.offer(i, squared);
  }
  std::ranges::transform(by_rank_.ranked(), matched_.begin(), [&](const RankedSample& match) {
    return RankedSample{problem_.samples[match.sample].sample, from_estimate[match.sample]};
  });
  result.candidates = problem_.candidates;
  result.ranks = std::span<const float>(ranks_).first(from_estimate.size());
}

/// Of the shapes, and of the times, of the samples that are plausible by the frame alone, as in the frames that the
/// bake learns from.
void CandidateWeights::set_spread(std::span<const float> alone, const ShapeEstimate& estimate,
                                  SurfaceFit& result) noexcept {
  const auto from_estimate = estimate.from_estimate();
  const Plausibility<float> plausibility(alone[best_alone_], noise_, settings_.sharpness);
  float all = 0, spread = 0;
  double variance = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const float weight = plausibility(alone[i]);
    all += weight;
    spread += weight * from_estimate[i];
    if (model_.sample_times.empty()) continue;
    const double later = model_.sample_times[problem_.samples[i].sample] - estimate.time_s();
    variance += double{weight} * later * later;
  }
  result.spread = spread / all;
  time_variance_ = variance / double{all};
}

void CandidateWeights::set_plausibilities() noexcept {
  const Plausibility<float> plausibility(problem_.candidates[0].distance, noise_, settings_.sharpness);
  std::ranges::transform(problem_.candidates, plausibility_.begin(),
                         [&](const Match& one) { return plausibility(one.distance); });
}

Verdict CandidateWeights::verdict(float misfit, float limit, std::span<const float> from_best) const noexcept {
  if (misfit > limit) return Verdict::no_simulation_fits;
  return are_several_plausible(from_best) ? Verdict::ambiguous : Verdict::matched;
}

/// Whether a candidate of another simulation than the best one explains the frame by a clearly different shape.
bool CandidateWeights::are_several_plausible(std::span<const float> from_best) const noexcept {
  constexpr float clearly_plausible = 0.5f;  // relative to the best candidate's plausibility
  constexpr float clearly_different = 1.5f;  // relative to its residual
  const auto candidates = problem_.candidates;
  const float least = clearly_different * std::sqrt(square(candidates[0].distance) + square(noise_));
  for (std::size_t i = 1; i < candidates.size(); ++i)
    if (candidates[i].sample.simulation != candidates[0].sample.simulation && plausibility_[i] > clearly_plausible &&
        from_best[i] > least)
      return true;
  return false;
}

}  // namespace lbea
