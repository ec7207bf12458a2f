#include "runtime/src/fit/surface_fit.hpp"

namespace lbea {

[[gnu::cold]]  // compiled for size
SurfaceFitter::SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches,
                             const FitSettings& settings)
    : model_(model),
      views_(std::move(views)),
      settings_(settings),
      code_(kernels()),
      search_(model, *views_.data(), max_matches, settings),
      estimate_(model, *views_.data(), search_, settings),
      pose_fit_(views_.data()->camera, PoseCenter::of(model), views_.data()->metric, search_.capacity()),
      matches_(std::min<std::uint32_t>(max_matches, static_cast<std::uint32_t>(search_.capacity()))),
      matched_(matches_.capacity()),
      ranks_(search_.capacity()),
      plausibility_(search_.capacity()),
      shown_(padded_cells(views_.data()->camera)),
      judged_residual_(shown_.size()),
      neighbor_residual_(shown_.size()),
      has_expectation_(std::ranges::any_of(views_.data()->expected, [](float residual) { return residual > 0; })) {}

SurfaceFit SurfaceFitter::fit(const CloudIndex& index, std::span<const RankedSample> proposed,
                              const FramePrior& prior) noexcept {
  watch_.lap_ns();
  search_.build_image(index);
  times_.depth_image = watch_.lap_ns();
  search_.search(proposed, prior);
  times_.ranking = watch_.lap_ns();
  if (is_hidden()) return fit_candidates({});
  return fit_candidates(estimate_.predict(search_.image().observed));
}

SurfaceFit SurfaceFitter::fit(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  watch_.lap_ns();
  search_.search(image, proposed);
  times_.ranking = watch_.lap_ns();
  return fit_candidates(image.predicted);
}

SurfaceFit SurfaceFitter::fit_candidates(std::span<const float> predicted) noexcept {
  SurfaceFit result;
  estimate_.compare();
  if (const PoseBelief* prior = search_.image().prior; prior != nullptr)
    pose_ = pose_fit_.estimate(estimate_.pose_problem(), *prior, settings_);
  estimate_.combine(predicted);
  weigh(result);  // candidates ranked by their distance from the estimate
  times_.estimate = watch_.lap_ns();
  judge(result);  // spread, misfit, verdict
  times_.judgment = watch_.lap_ns();
  return result;
}

void SurfaceFitter::add_times(StageTimes& times) const noexcept {
  times.depth_image += times_.depth_image;
  times.ranking += times_.ranking;
  times.estimate += times_.estimate;
  times.judgment += times_.judgment;
}

void SurfaceFitter::weigh(SurfaceFit& result) noexcept {
  const auto candidates = search_.candidates();
  const auto from_estimate = estimate_.from_estimate();
  matches_.clear();
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    const float squared = square(from_estimate[i]) + settings_.residual_rank * square(candidates[i].distance);
    ranks_[i] = std::sqrt(squared);
    matches_.offer(i, squared);
  }
  std::ranges::transform(matches_.ranked(), matched_.begin(), [&](const RankedSample& match) {
    return RankedSample{search_.sample(match.sample), from_estimate[match.sample]};
  });
  result.candidates = candidates;
  result.ranks = std::span<const float>(ranks_).first(candidates.size());
  result.estimate = estimate_.samples();
  result.estimate_residual = estimate_.residual();
  result.residual = candidates[0].distance;
}

void SurfaceFitter::judge(SurfaceFit& result) noexcept {
  set_spread(result);
  verdict_ = Verdict::unknown;
  error_90_ = std::numeric_limits<float>::quiet_NaN();
  constexpr float least_judged = 0.1f;   // a few stray points are no evidence for or against the samples
  constexpr float least_bounded = 0.5f;  // the bake learns the errors of frames of which a third is hidden
  const float shown = shown_share();
  if (!has_expectation_ || shown < least_judged) return;
  const DepthImages& images = *views_.data();
  const float per_spread = is_hidden() ? images.hidden_error_per_spread : images.error_per_spread;
  if (per_spread > 0) error_90_ = per_spread * result.spread;
  if (shown >= least_bounded || !is_hidden()) result.error_90 = error_90_;
  set_misfit(result);
  verdict_ = result.misfit > images.misfit_limit      ? Verdict::no_simulation_fits
             : are_several_plausible(result.residual) ? Verdict::ambiguous
                                                      : Verdict::matched;
}

/// Of the shapes, and of the times, of the samples that are plausible by the frame alone, as in the frames that the
/// bake learns from.
void SurfaceFitter::set_spread(SurfaceFit& result) noexcept {
  const auto alone = search_.residuals_alone(), from_estimate = estimate_.from_estimate();
  const Plausibility<float> plausibility(alone[search_.best_alone()], views_.data()->metric.mesh_noise,
                                         settings_.sharpness);
  float all = 0, spread = 0;
  double variance = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const float weight = plausibility(alone[i]);
    all += weight;
    spread += weight * from_estimate[i];
    if (model_.sample_times.empty()) continue;
    const double later = model_.sample_times[search_.sample(i)] - estimate_.time_s();
    variance += double{weight} * later * later;
  }
  result.spread = spread / all;
  time_variance_ = variance / double{all};
}

/// Cells that the frame shows, relative to those that the best candidate fills.
float SurfaceFitter::shown_share() const noexcept {
  const auto shown = std::ranges::count_if(search_.image().observed, [](float depth) { return depth >= 0; });
  const auto filled =
      std::ranges::count_if(search_.image_of(0), [](std::uint16_t depth) { return depth != empty_cell; });
  return static_cast<float>(shown) / std::max(static_cast<float>(filled), 1.0f);
}

/// Relative to what the plausible candidates' residuals would be in a run that is not in the ensemble.
void SurfaceFitter::set_misfit(SurfaceFit& result) noexcept {
  const float noise = square(views_.data()->metric.mesh_noise);
  const Plausibility<float> plausibility(result.residual, views_.data()->metric.mesh_noise, settings_.sharpness);
  float all = 0, expected = 0;
  for (std::size_t i = 0; i < search_.count(); ++i) {
    plausibility_[i] = plausibility(search_.candidates()[i].distance);
    all += plausibility_[i];
    expected += plausibility_[i] * square(views_.expected_residual(search_.sample(i)));
  }
  result.misfit = std::sqrt((judged_square() + noise) / (expected / all + noise));
}

/// The best candidate's squared residual, tolerant of edges, of what the frame shows, in squared length units; after
/// interpolation to the state before or after it, if less than half remains then: the frame is between the two states.
/// Another shape hardly becomes more similar.
float SurfaceFitter::judged_square() noexcept {
  const DepthImages& images = *views_.data();
  const std::uint32_t sample = search_.sample(search_.best_alone());  // the history does not decide whether one fits
  // Where something hides a part, an empty cell is no evidence.
  std::ranges::transform(search_.image().observed, shown_.begin(),
                         [&](float depth) { return is_hidden() && depth == nothing_seen ? not_observed : depth; });
  const auto compare = [&](std::uint32_t with, std::span<float> residuals) {
    return tolerant_residuals(code_, images.camera, search_.ranking().prices(), shown_, images.of_sample(with),
                              residuals);
  };
  const float square = compare(sample, judged_residual_);
  float least = 1;
  for (const std::uint32_t other : {sample - 1, sample + 1}) {  // 0 - 1: beyond the last sample
    if (other >= model_.info.samples || model_.samples[other][0] != model_.samples[sample][0]) continue;
    compare(other, neighbor_residual_);
    least = std::min(least, share_after_interpolation(code_, judged_residual_, neighbor_residual_));
  }
  constexpr float between = 0.5f;
  return (least < between ? least : 1) * square * images.camera.depth_step * images.camera.depth_step;
}

/// Whether a candidate of another simulation than the best one explains the frame by a clearly different shape.
bool SurfaceFitter::are_several_plausible(float best_residual) const noexcept {
  constexpr float clearly_plausible = 0.5f;  // relative to the best candidate's plausibility
  constexpr float clearly_different = 1.5f;  // relative to its residual
  const auto candidates = search_.candidates();
  const float least = clearly_different * std::sqrt(square(best_residual) + square(views_.data()->metric.mesh_noise));
  for (std::size_t i = 1; i < candidates.size(); ++i)
    if (candidates[i].sample.simulation != candidates[0].sample.simulation && plausibility_[i] > clearly_plausible &&
        estimate_.from_best()[i] > least)
      return true;
  return false;
}

}  // namespace lbea
