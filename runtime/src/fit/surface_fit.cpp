#include "runtime/src/fit/surface_fit.hpp"

namespace lbea {

[[gnu::cold]]  // compiled for size
SurfaceFitter::SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches,
                             const FitSettings& settings, std::uint32_t most_compared)
    : model_(model),
      views_(std::move(views)),
      settings_(views_.data()->priced(settings)),
      code_(kernels()),
      search_(model, *views_.data(), max_matches, settings_),
      residuals_(*views_.data(), search_, std::max<std::size_t>(search_.capacity(), most_compared)),
      gram_(search_.capacity() * search_.capacity()),
      estimate_(model, views_.data()->regression, search_.capacity(), settings_),
      correction_(model, views_.data()->metric.mesh_noise, settings_),
      surface_pose_(PoseCenter::of(model), views_.data()->metric.mesh_noise, correction_.stride(), settings_),
      pose_fit_(views_.data()->camera, PoseCenter::of(model), views_.data()->metric,
                std::max<std::size_t>(search_.capacity(), most_compared)),
      weights_(model, search_.capacity(), max_matches, views_.data()->metric.mesh_noise, settings_),
      shown_(padded_cells(views_.data()->camera)),
      judged_residual_(shown_.size()),
      neighbor_residual_(shown_.size()),
      has_expectation_(std::ranges::any_of(views_.data()->expected, [](float residual) { return residual > 0; })) {}

SurfaceFit SurfaceFitter::fit(const CloudIndex& index, std::span<const RankedSample> proposed,
                              const FramePrior& prior) noexcept {
  watch_.lap_ns();
  search_.ranking().use(images().metric);
  search_.build_image(index);
  times_.depth_image = watch_.lap_ns();
  search_.search(proposed, prior);
  times_.ranking = watch_.lap_ns();
  predicted_ = is_hidden() ? std::span<const float>() : residuals_.predict(search_.image().observed);
  return fit_candidates(predicted_);
}

SurfaceFit SurfaceFitter::fit(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  watch_.lap_ns();
  search_.search(image, proposed);
  times_.ranking = watch_.lap_ns();
  return fit_candidates(image.predicted);
}

SurfaceFit SurfaceFitter::fit_candidates(std::span<const float> predicted) noexcept {
  SurfaceFit result;
  correction_.clear();
  compare();
  if (const PoseBelief* prior = search_.image().prior; prior != nullptr)
    pose_ = pose_by(problem(), estimate_.from_best(), residuals_.filled(), *prior);
  estimate_.combine();
  if (is_hidden()) predicted = predict_hidden(predicted);
  estimate_.follow(ShapePrediction::of(predicted, residuals_.regression(), is_hidden()));
  result.estimate = estimate_.samples();
  result.estimate_residual = estimate_.residual();
  result.residual = search_.candidates()[0].distance;
  weights_.weigh(problem(), search_.residuals_alone(), estimate_, result);  // ranks, spread
  times_.estimate = watch_.lap_ns();
  judge(result);  // bound, misfit, verdict
  times_.judgment = watch_.lap_ns();
  return result;
}

/// Sets the residuals of the candidates, their mean products, and their distances from the best one.
void SurfaceFitter::compare() noexcept {
  const auto samples = search_.ranking().ranked();
  const auto gram = std::span(gram_).first(samples.size() * samples.size());
  residuals_.compare(samples);
  std::ranges::fill(gram, 0.0f);
  residuals_.add_products(square(views_.data()->camera.depth_step) / residuals_.filled(), gram);
  estimate_.begin(problem());
}

void SurfaceFitter::correct(const CloudIndex& index, SurfaceFit& result) noexcept {
  begin_correction(estimate_, index);
  const auto weights = correction_.solve(!is_hidden());
  if (weights.empty()) return correction_.clear();
  estimate_.reweigh(weights);
  result.estimate = estimate_.samples();
  weights_.rank(estimate_.from_estimate(), 0, result);
}

void SurfaceFitter::begin_correction(const ShapeEstimate& of, const CloudIndex& index,
                                     std::span<const StateBetween> states) noexcept {
  correction_.begin(of);
  correction_.add({index, images().camera, search_.image().observed, states});
}

std::optional<PoseMeasurement> SurfaceFitter::pose_by_points(const PoseMotion& calibration) noexcept {
  if (!correction_.shows_something()) return {};
  return surface_pose_.measure(correction_.equations(), calibration);
}

EstimateProblem SurfaceFitter::problem() const noexcept {
  return {.samples = search_.ranking().ranked(),
          .candidates = search_.candidates(),
          .gram = std::span(gram_).first(search_.count() * search_.count()),
          .proposed = search_.proposed(),
          .is_hidden = is_hidden(),
          .reads_copies = search_.reads_copies()};
}

/// What the compared candidates say about the pose. Where something hides a part, the edges of what is seen are not
/// those of the component.
const PoseBelief& SurfaceFitter::pose_by(const EstimateProblem& problem, std::span<const float> from_best, float cells,
                                         const PoseBelief& prior) noexcept {
  const FrameImage& image = search_.image();
  return pose_fit_.estimate({.observed = image.observed,
                             .points = image.points,
                             .images = images(),
                             .candidates = problem.samples,
                             .residuals = residuals_.all(),
                             .gram = problem.gram,
                             .from_best = from_best,
                             .cells = cells,
                             .has_silhouette = !image.is_hidden},
                            prior, settings_);
}

/// By the completed image, unless it is known.
std::span<const float> SurfaceFitter::predict_hidden(std::span<const float> predicted) noexcept {
  if (predicted.empty()) return residuals_.predict_completed(estimate_.shares());
  residuals_.complete(estimate_.shares());
  return predicted;
}

void SurfaceFitter::compare_again(const DepthMetric& metric) noexcept {
  search_.ranking().use(metric);
  search_.ranking().set_frame(search_.image().observed, is_hidden(), search_.image().knows_hidden);
}

namespace {

SquareSums scaled(const SquareSums& sums, float squared_step) noexcept {
  return {squared_step * sums.squares, squared_step * sums.hidden, sums.cells, squared_step * sums.depths, sums.shown};
}

}  // namespace

SquareSums SurfaceFitter::squares_of(std::uint32_t sample) noexcept {
  return scaled(search_.ranking().compare(images().of_sample(sample)), square(images().camera.depth_step));
}

SquareSums SurfaceFitter::shown_squares_of(std::uint32_t sample) noexcept {
  return scaled(search_.ranking().compare_shown(images().of_sample(sample)), square(images().camera.depth_step));
}

ShapePrediction SurfaceFitter::predict_again(std::span<const float> shares) noexcept {
  return ShapePrediction::of(is_hidden() ? residuals_.predict_completed(shares) : predicted_, images().regression,
                             is_hidden());
}

void SurfaceFitter::add_times(StageTimes& times) const noexcept {
  times.depth_image += times_.depth_image;
  times.ranking += times_.ranking;
  times.estimate += times_.estimate;
  times.judgment += times_.judgment;
}

void SurfaceFitter::judge(SurfaceFit& result) noexcept {
  verdict_ = Verdict::unknown;
  error_90_ = std::numeric_limits<float>::quiet_NaN();
  const float shown = shown_share(search_.sample(0));
  if (!has_expectation_ || shown < least_judged || is_sparse(shown)) return;
  const DepthImages& images = *views_.data();
  const double spread = double{result.spread}, per_spread = error_bound().per_spread_at(spread);
  if (per_spread > 0) error_90_ = static_cast<float>(per_spread * spread);
  if (shown >= least_bounded || !is_hidden()) result.error_90 = error_90_;
  set_misfit(result);
  verdict_ = weights_.verdict(result.misfit, images.misfit_limit, estimate_.from_best());
}

bool SurfaceFitter::is_sparse(float shown_share) const noexcept {
  constexpr float filled_by_chance = 0.632f;  // 1 - exp(-1): of the cells, by one independent point per cell
  return search_.image().is_sparse && shown_share < filled_by_chance;
}

float SurfaceFitter::shown_share(std::uint32_t sample) const noexcept {
  const auto shown = std::ranges::count_if(search_.image().observed, [](float depth) { return depth >= 0; });
  const auto filled =
      std::ranges::count_if(views_.data()->of_sample(sample), [](std::uint16_t depth) { return depth != empty_cell; });
  return static_cast<float>(shown) / std::max(static_cast<float>(filled), 1.0f);
}

/// Relative to what the plausible candidates' residuals would be in a run that is not in the ensemble. The history does
/// not decide whether a sample fits.
void SurfaceFitter::set_misfit(SurfaceFit& result) noexcept {
  const float noise = square(views_.data()->metric.mesh_noise);
  const float expected =
      weights_.plausible_mean([&](std::uint32_t sample) { return square(views_.expected_residual(sample)); });
  const float squared = judged_square(search_.sample(weights_.best_alone()));
  result.misfit = std::sqrt((squared + noise) / (expected + noise));
}

// A frame between two states is explained by interpolation; another shape hardly becomes more similar by it.
float SurfaceFitter::judged_square(std::uint32_t sample) noexcept {
  const DepthImages& images = *views_.data();
  // Where something hides a part, an empty cell is no evidence.
  std::ranges::transform(search_.image().observed, shown_.begin(),
                         [&](float depth) { return is_hidden() && depth == nothing_seen ? not_observed : depth; });
  const auto compare = [&](std::uint32_t with, std::span<float> residuals) {
    return tolerant_residuals(code_, images.camera, prices_of(images.metric, images.camera), shown_,
                              images.of_sample(with), residuals);
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

}  // namespace lbea
