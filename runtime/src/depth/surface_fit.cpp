#include "runtime/src/depth/surface_fit.hpp"

namespace lbea {
namespace {

std::vector<std::uint32_t> count_filled(const DepthImages& images) {
  std::vector<std::uint32_t> counts(images.depths.size() / padded_cells(images.camera));
  for (std::size_t s = 0; s < counts.size(); ++s)
    for (const std::uint16_t depth : images.of_sample(s)) counts[s] += depth != empty_cell ? 1u : 0u;
  return counts;
}

void add(float weight, std::span<const float> values, std::span<float> sum) noexcept {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * values[i];
}

}  // namespace

[[gnu::cold]]  // compiled for size
SurfaceFitter::SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches,
                             const FitSettings& settings)
    : model_(model),
      views_(std::move(views)),
      settings_(settings),
      code_(kernels()),
      frame_(views_.data()->camera),
      surroundings_(views_.data()->camera),
      limited_(padded_cells(views_.data()->camera)),
      known_(limited_.size()),
      thinned_(*views_.data()),
      proposed_(thinned_.empty() ? 0 : std::min(settings.proposals, model.info.samples)),
      ordered_(std::min(std::max(settings.proposals, max_matches), model.info.samples)),
      filled_cells_(count_filled(*views_.data())),
      few_(8),
      costs_(model, *views_.data()),
      impact_s_(EnsembleTimes::of(model).impact_s),
      best_(views_.data()->camera, std::min(settings.candidates, model.info.samples), views_.data()->metric,
            std::min(std::max(settings.proposals, max_matches), model.info.samples), settings.sharpness),
      matches_(std::min<std::uint32_t>(max_matches, static_cast<std::uint32_t>(best_.capacity()))),
      matched_(matches_.capacity()),
      residuals_(best_.capacity() * padded_cells(views_.data()->camera)),
      gathered_(residuals_.size()),
      lines_(padded_cells(views_.data()->camera)),
      shown_(padded_cells(views_.data()->camera)),
      judged_residual_(padded_cells(views_.data()->camera)),
      neighbor_residual_(padded_cells(views_.data()->camera)),
      gram_(best_.capacity() * best_.capacity()),
      products_(best_.capacity()),
      linear_(best_.capacity()),
      pose_fit_(views_.data()->camera, PoseCenter::of(model), views_.data()->metric, best_.capacity()),
      simplex_(best_.capacity()),
      ridge_(best_.capacity()),
      predictor_(*views_.data()),
      completed_(views_.data()->camera),
      target_(ShapeRegression::shape_scores),
      neighbors_(std::min(settings.neighbors, model.info.samples)),
      offsets_(neighbors_.capacity() * ShapeRegression::shape_scores),
      by_score_(offsets_.size()),
      neighbor_gram_(neighbors_.capacity() * neighbors_.capacity()),
      weights_(neighbors_.capacity()),
      prices_(neighbors_.capacity()),
      neighbor_ridge_(neighbors_.capacity()),
      has_expectation_(std::ranges::any_of(views_.data()->expected, [](float residual) { return residual > 0; })),
      shapes_(model),
      landmark_buffer_((best_.capacity() + 1) * shapes_.size()),
      landmarks_(best_.capacity()),
      estimate_landmarks_(shapes_.size()),
      from_best_(best_.capacity()),
      from_estimate_(best_.capacity()),
      ranks_(best_.capacity()),
      plausibility_(best_.capacity()),
      shares_(best_.capacity()),
      residual_alone_(best_.capacity()),
      candidates_(best_.capacity()),
      estimate_(std::max(best_.capacity(), neighbors_.capacity())) {}

SurfaceFit SurfaceFitter::fit(const CloudIndex& index, std::span<const RankedSample> proposed,
                              const FramePrior& prior) noexcept {
  watch_.lap_ns();
  reads_copies_ = true;
  frame_.build(index);  // the depth image of the frame
  std::ranges::copy(frame_.cells(), limited_.begin());
  surroundings_.limit(limited_);
  times_.depth_image = watch_.lap_ns();
  FrameImage image{limited_, true, {}, prior.pose, frame_.points()};
  if (thinned_.empty()) {
    costs_.assess(proposed, prior.expectation);
    return fit_image(image, proposed);
  }
  const float most = most_explained(least_residual(limited_));
  FrameExpectation expectation = prior.expectation != nullptr ? *prior.expectation : FrameExpectation{};
  may_be_undeformed_ = expectation.is_first && is_explained_undeformed(most);
  if (expectation.is_first && !may_be_undeformed_) expectation.latest = {};
  const FrameExpectation* expected = prior.expectation != nullptr ? &expectation : nullptr;
  costs_.assess(proposed, expected);
  if (prior.hidden != nullptr && prior.hidden->is_confirmed_by(frame_.cells()) &&
      is_explained_with(*prior.hidden, most)) {
    image.observed = known_;
    image.knows_hidden = true;
  } else if (choose_candidates(frame_.cells(), proposed) <= most) {
    times_.ranking = watch_.lap_ns();
    return fit_candidates({frame_.cells(), false, predictor_.predict(frame_.cells()), prior.pose, frame_.points()},
                          proposed);
  }
  // Eq. 3 proposes wrong samples where something hides a part: it measures distances to points beside that part.
  thinned_.propose(image.observed, proposed_);
  costs_.assess(proposed_.ranked(), expected);
  return fit_image(image, proposed_.ranked());
}

/// Greatest squared residual of a sample that explains the frame. limited: the least one without the cells that may be
/// hidden.
float SurfaceFitter::most_explained(float limited) const noexcept {
  return settings_.hidden * (limited + square(views_.data()->metric.mesh_noise / views_.data()->camera.depth_step));
}

/// Whether an undeformed sample explains what the frame shows. Changes proposed_.
bool SurfaceFitter::is_explained_undeformed(float most) noexcept {
  if (model_.sample_times.empty()) return false;
  thinned_.propose(limited_, proposed_);
  return std::ranges::any_of(proposed_.ranked(), [&](const RankedSample& one) {
    return model_.sample_times[one.sample] <= impact_s_ &&
           mean_square(code_, limited_, views_.data()->of_sample(one.sample).data(), best_.prices()) <= most;
  });
}

/// Whether a sample explains the whole frame but for what something hid in earlier ones. Sets known_.
bool SurfaceFitter::is_explained_with(const HiddenCells& hidden, float most) noexcept {
  std::ranges::copy(frame_.cells(), known_.begin());
  hidden.exclude_from(known_);
  return least_residual(known_) <= most;
}

/// The least one, squared, in depth steps.
float SurfaceFitter::least_residual(std::span<const float> observed) noexcept {
  thinned_.propose(observed, few_);
  float least = std::numeric_limits<float>::infinity();
  for (const RankedSample& sample : few_.ranked()) {
    const auto image = views_.data()->of_sample(sample.sample);
    least = std::min(least, mean_square(code_, observed, image.data(), best_.prices()));
  }
  return least;
}

SurfaceFit SurfaceFitter::fit(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  watch_.lap_ns();
  reads_copies_ = false;
  return fit_image(image, proposed);
}

SurfaceFit SurfaceFitter::fit_image(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  if (image.is_hidden)
    choose_hidden_candidates(image, proposed);
  else
    choose_candidates(image.observed, proposed);
  times_.ranking = watch_.lap_ns();
  return fit_candidates(image, proposed);
}

SurfaceFit SurfaceFitter::fit_candidates(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  SurfaceFit result;
  is_hidden_ = image.is_hidden;
  compare_candidates(image);
  if (image.prior != nullptr) estimate_pose(image);
  combine_candidates();                 // their convex combination with the least residual
  if (!image.is_hidden) extrapolate();  // the estimate may lie beside the samples
  result.estimate_residual = residual_of_combination();
  use_candidates();
  FrameImage predicted = image;
  if (image.is_hidden) predicted.predicted = predict_hidden(image);
  if (!predicted.predicted.empty()) use_neighbors(predicted, proposed);
  weigh(result);  // candidates ranked by their distance from the estimate
  times_.estimate = watch_.lap_ns();
  judge(result, image);  // misfit, spread, verdict
  times_.judgment = watch_.lap_ns();
  return result;
}

/// The samples with the least residual. Returns the least one,
/// squared, before hidden cells are left out.
float SurfaceFitter::choose_candidates(std::span<float> observed, std::span<const RankedSample> proposed) noexcept {
  const DepthImages& images = *views_.data();
  const std::size_t count = std::min(proposed.size(), ordered_.size());
  const auto ordered = std::span(ordered_).first(count);
  std::ranges::copy(proposed.first(count), ordered.begin());
  if (reads_copies_ && count > best_.capacity()) thinned_.put_first(observed, best_.capacity(), ordered);
  const float least =
      best_.rank(observed, images.depths, ordered, &costs_,
                 reads_copies_ ? std::span<const std::uint32_t>(filled_cells_) : std::span<const std::uint32_t>());
  set_candidates(price(best_.ranked()[0].sample));
  return least;
}

/// Hidden parts and the edges of what hides them distinguish samples but are no residual of what the frame shows: what
/// they cost the best sample is subtracted from all.
void SurfaceFitter::choose_hidden_candidates(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  set_candidates(best_.rank_hidden(image.observed, views_.data()->depths, proposed, &costs_, image.knows_hidden));
}

/// not_residual: part of the best ones' mean squares.
void SurfaceFitter::set_candidates(float not_residual) noexcept {
  const float step = views_.data()->camera.depth_step, price_of_best = price(best_.ranked()[0].sample);
  for (std::size_t k = 0; k < count(); ++k) {
    const RankedSample& sample = best_.ranked()[k];
    const auto length = [step](float squared_steps) { return step * std::sqrt(std::max(squared_steps, 0.0f)); };
    candidates_[k] = {sample_at(sample.sample), length(sample.distance - not_residual)};
    residual_alone_[k] = length(sample.distance - not_residual + price_of_best - price(sample.sample));
    landmarks_[k] = shapes_.of(sample.sample, reads_copies_, buffer(k));
  }
}

// The residual of a combination is approximated by the combination of the residuals. That is exact along a line of
// sight that meets the same surface in all samples. A cell that only some samples fill counts with their share.
void SurfaceFitter::compare_candidates(const FrameImage& frame) noexcept {
  const DepthImages& images = *views_.data();
  const std::size_t k = count(), cells = padded_cells(images.camera);
  const float* observed = frame.observed.data();
  const auto image_of = [&](std::size_t i) { return images.of_sample(best_.ranked()[i].sample); };
  filled_ = code_.compare_depths(observed, image_of(0).data(), cells, best_.prices()).filled;
  for (std::size_t i = 0; i < k; ++i) {
    const auto residuals = std::span(residuals_).subspan(i * cells, cells);
    code_.subtract_depths(observed, image_of(i).data(), cells, best_.prices(), residuals.data());
    if (!frame.is_hidden) continue;
    const float hidden = best_.price_hidden(frame.observed, image_of(i), residuals);
    if (i == 0) filled_ -= hidden;
  }
  filled_ = std::max(filled_, 1.0f);
  const float scale =
      images.camera.depth_step * images.camera.depth_step / filled_;  // to a mean square in length units
  const std::size_t stride = gather_residuals(cells);
  for (std::size_t i = 0; i < k; ++i) {
    code_.project(gathered_.data(), i + 1, stride, &gathered_[i * stride], products_.data());
    for (std::size_t j = 0; j <= i; ++j) gram_[i * k + j] = gram_[j * k + i] = scale * products_[j];
  }
  for (std::size_t i = 0; i < k; ++i) from_best_[i] = shapes_.mean_distance(landmarks_[i], landmarks_[0]);
}

/// Copies the residuals without the lines of cells at which all are zero. Returns the number of cells that remain.
std::size_t SurfaceFitter::gather_residuals(std::size_t cells) noexcept {
  constexpr std::size_t line = 32;  // with whole pairs of lanes, products are the same as with all cells
  lines_.clear();
  for (std::size_t begin = 0; begin < cells; begin += line) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < count(); ++i)
      for (std::size_t c = begin; c < begin + line; ++c)
        bits |= std::bit_cast<std::uint32_t>(residuals_[i * cells + c]);
    if (bits << 1 != 0) lines_.push_back(static_cast<std::uint32_t>(begin));  // but for the sign of zeros
  }
  const std::size_t stride = line * lines_.size();
  for (std::size_t i = 0; i < count(); ++i)
    for (std::size_t l = 0; l < lines_.size(); ++l)
      std::copy_n(&residuals_[i * cells + lines_[l]], line, &gathered_[i * stride + line * l]);
  return stride;
}

/// Where something hides a part, the edges of what is seen are not those of the component.
void SurfaceFitter::estimate_pose(const FrameImage& image) noexcept {
  pose_ = pose_fit_.estimate({.observed = image.observed,
                              .points = image.points,
                              .in_all = best_.in_all(),
                              .images = *views_.data(),
                              .candidates = best_.ranked(),
                              .residuals = residuals_,
                              .gram = std::span(gram_).first(count() * count()),
                              .from_best = from_best_,
                              .cells = filled_,
                              .has_silhouette = !image.is_hidden},
                             *image.prior, settings_);
}

void SurfaceFitter::combine_candidates() noexcept {
  const std::size_t k = count();
  for (std::size_t i = 0; i < k; ++i)
    linear_[i] = settings_.residual_price * candidates_[i].distance * candidates_[i].distance +
                 settings_.distance_price * from_best_[i] * from_best_[i];
  const auto w = simplex_.solve(gram_, k, std::span<const float>(linear_).first(k));
  std::ranges::copy(w, shares_.begin());
}

void SurfaceFitter::extrapolate() noexcept {
  const std::size_t k = count();
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) mean += gram_[i * k + i] / static_cast<float>(k);
  for (std::size_t i = 0; i < k; ++i)
    linear_[i] = settings_.change_price * mean + settings_.change_distance_price * square(from_best_[i]);
  if (mean > 0) ridge_.solve(gram_, k, std::span(linear_).first(k), std::span(shares_).first(k));
}

float SurfaceFitter::residual_of_combination() const noexcept {
  const std::size_t k = best_.ranked().size();
  float squared = 0;
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j < k; ++j) squared += shares_[i] * shares_[j] * gram_[i * k + j];
  return std::sqrt(std::max(squared, 0.0f));
}

void SurfaceFitter::use_candidates() noexcept {
  begin_estimate();
  for (std::size_t i = 0; i < count(); ++i)
    if (shares_[i] != 0) use(best_.ranked()[i].sample, shares_[i], landmarks_[i]);
}

void SurfaceFitter::begin_estimate() noexcept {
  used_ = 0;
  std::ranges::fill(estimate_landmarks_, 0.0f);
  shape_ = {};
  time_ = {};
}

void SurfaceFitter::use(std::uint32_t row, float weight, std::span<const float> landmarks) noexcept {
  estimate_[used_++] = {sample_at(row), weight};
  add(weight, landmarks, estimate_landmarks_);
  if (views_.data()->regression.blend > 0) add(weight, views_.data()->regression.shape(row), shape_);
  if (!model_.sample_times.empty()) time_.mean_s += double{weight} * model_.sample_times[row];
}

/// The shape predicted from the completed image, unless it is known.
std::span<const float> SurfaceFitter::predict_hidden(const FrameImage& image) noexcept {
  completed_.clear();
  for (std::size_t i = 0; i < count(); ++i)
    if (shares_[i] != 0)
      completed_.add(shares_[i], views_.data()->of_sample(best_.ranked()[i].sample),
                     std::span(residuals_).subspan(i * image.observed.size(), image.observed.size()),
                     best_.hidden_price());
  completed_.finish(image.observed);
  if (!image.predicted.empty() || views_.data()->regression.hidden_blend == 0) return image.predicted;
  return predictor_.predict(completed_.cells());
}

// The candidates do not span all shapes near them: more samples, near the blended shape, represent it better.
void SurfaceFitter::use_neighbors(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  const ShapeRegression& regression = views_.data()->regression;
  constexpr std::size_t scores = ShapeRegression::shape_scores;
  move_toward(image);
  neighbors_.clear();
  for (const RankedSample& proposal : proposed)
    neighbors_.offer(proposal.sample, squared_distance(regression.shape(proposal.sample), target_));
  const std::size_t k = neighbors_.ranked().size();
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) {
    const RankedSample& neighbor = neighbors_.ranked()[i];
    std::ranges::transform(regression.shape(neighbor.sample), target_, &offsets_[i * scores], std::minus<>{});
    for (std::size_t score = 0; score < scores; ++score) by_score_[score * k + i] = offsets_[i * scores + score];
    mean += neighbor.distance / static_cast<float>(k);
  }
  for (std::size_t i = 0; i < k; ++i) {
    const std::span row = std::span(neighbor_gram_).subspan(i * k + i, k - i);
    std::ranges::fill(row, 0.0f);
    for (std::size_t score = 0; score < scores; ++score)
      add(offsets_[i * scores + score], std::span(by_score_).subspan(score * k + i, k - i), row);
    for (std::size_t j = i + 1; j < k; ++j) neighbor_gram_[j * k + i] = neighbor_gram_[i * k + j];
  }
  const float price = settings_.neighbor_price * mean;
  if (!(price >= std::numeric_limits<float>::min())) return;  // all neighbors have the same shape
  std::ranges::fill(prices_, price);
  std::ranges::fill(weights_, 1 / static_cast<float>(k));
  neighbor_ridge_.solve(neighbor_gram_, k, std::span(prices_).first(k), std::span(weights_).first(k));
  begin_estimate();
  for (std::size_t i = 0; i < k; ++i) {
    const std::uint32_t sample = neighbors_.ranked()[i].sample;
    use(sample, weights_[i], shapes_.of(sample, reads_copies_, buffer(count())));
  }
}

/// Sets the target. Predictions far from the candidates' combination, of a frame unlike all training images for
/// example, move it no further than usual ones.
void SurfaceFitter::move_toward(const FrameImage& image) noexcept {
  const ShapeRegression& regression = views_.data()->regression;
  const float blend = image.is_hidden ? regression.hidden_blend : regression.blend;
  const float most = image.is_hidden ? regression.hidden_most_difference : regression.most_difference;
  std::ranges::fill(target_, 0.0f);
  for (std::size_t i = 0; i < count(); ++i) add(shares_[i], regression.shape(best_.ranked()[i].sample), target_);
  const float difference = std::sqrt(squared_distance(image.predicted, target_));
  if (!std::isfinite(difference)) return;  // by a forged model
  const float share = blend * std::min(1.0f, most / std::max(difference, 1e-30f));
  for (std::size_t i = 0; i < target_.size(); ++i) target_[i] += share * (image.predicted[i] - target_[i]);
}

void SurfaceFitter::weigh(SurfaceFit& result) noexcept {
  const std::size_t k = count();
  for (std::size_t i = 0; i < k; ++i) from_estimate_[i] = shapes_.mean_distance(landmarks_[i], estimate_landmarks_);
  rank();
  result.candidates = std::span<const Match>(candidates_).first(k);
  result.ranks = std::span<const float>(ranks_).first(k);
  result.estimate = std::span<const WeightedSample>(estimate_).first(used_);
  result.residual = candidates_[0].distance;
}

void SurfaceFitter::rank() noexcept {
  matches_.clear();
  for (std::uint32_t i = 0; i < count(); ++i) {
    const float squared = square(from_estimate_[i]) + settings_.residual_rank * square(candidates_[i].distance);
    ranks_[i] = std::sqrt(squared);
    matches_.offer(i, squared);
  }
  std::ranges::transform(matches_.ranked(), matched_.begin(), [this](const RankedSample& match) {
    return RankedSample{best_.ranked()[match.sample].sample, from_estimate_[match.sample]};
  });
}

/// Of the shapes and times of the samples that are plausible by the frame alone, as in the frames that the bake learns
/// from. Sets the time's variance.
float SurfaceFitter::spread_alone() noexcept {
  const Plausibility<float> plausibility(least_alone(), views_.data()->metric.mesh_noise, settings_.sharpness);
  float all = 0, spread = 0;
  double variance = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    const float weight = plausibility(residual_alone_[i]);
    all += weight;
    spread += weight * from_estimate_[i];
    if (model_.sample_times.empty()) continue;
    const double later = model_.sample_times[best_.ranked()[i].sample] - time_.mean_s;
    variance += double{weight} * later * later;
  }
  time_.variance = variance / double{all};
  return spread / all;
}

/// Cells that the frame shows, relative to those that the best candidate fills.
float SurfaceFitter::shown_share(std::span<const float> observed) const noexcept {
  const auto image = views_.data()->of_sample(best_.ranked()[0].sample);
  const auto shown = std::ranges::count_if(observed, [](float depth) { return depth >= 0; });
  const auto filled = std::ranges::count_if(image, [](std::uint16_t depth) { return depth != empty_cell; });
  return static_cast<float>(shown) / std::max(static_cast<float>(filled), 1.0f);
}

/// The best candidate's squared residual, tolerant of edges, of what the frame shows, in squared length units; after
/// interpolation to the state before or after it, if less than half remains then: the frame is between the two states.
/// Another shape hardly becomes more similar.
float SurfaceFitter::judged_square(const FrameImage& image) noexcept {
  const DepthImages& images = *views_.data();
  const std::uint32_t sample = best_.ranked()[best_alone()].sample;
  // Where something hides a part, an empty cell is no evidence.
  std::ranges::transform(image.observed, shown_.begin(),
                         [&](float depth) { return image.is_hidden && depth == nothing_seen ? not_observed : depth; });
  const auto compare = [&](std::uint32_t with, std::span<float> residuals) {
    return tolerant_residuals(code_, images.camera, best_.prices(), shown_, images.of_sample(with), residuals);
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

void SurfaceFitter::judge(SurfaceFit& result, const FrameImage& image) noexcept {
  const DepthImages& images = *views_.data();
  const Plausibility<float> plausibility(result.residual, views_.data()->metric.mesh_noise, settings_.sharpness);
  const float noise = square(views_.data()->metric.mesh_noise), best = square(result.residual);
  float all = 0, expected = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    plausibility_[i] = plausibility(candidates_[i].distance);
    all += plausibility_[i];
    expected += plausibility_[i] * square(views_.expected_residual(best_.ranked()[i].sample));
  }
  result.spread = spread_alone();
  verdict_ = Verdict::unknown;
  error_90_ = std::numeric_limits<float>::quiet_NaN();
  constexpr float least_judged = 0.1f;   // a few stray points are no evidence for or against the samples
  constexpr float least_bounded = 0.5f;  // the bake learns the errors of frames of which a third is hidden
  const float shown = shown_share(image.observed);
  if (!has_expectation_ || shown < least_judged) return;
  const float per_spread = image.is_hidden ? images.hidden_error_per_spread : images.error_per_spread;
  if (per_spread > 0) error_90_ = per_spread * result.spread;
  if (shown >= least_bounded || !image.is_hidden) result.error_90 = error_90_;
  result.misfit = std::sqrt((judged_square(image) + noise) / (expected / all + noise));
  constexpr float clearly_plausible = 0.5f;  // relative to the best candidate's plausibility
  constexpr float clearly_different = 1.5f;  // relative to its residual
  bool several = false;
  for (std::size_t i = 1; i < count(); ++i)
    several |= candidates_[i].sample.simulation != candidates_[0].sample.simulation &&
               plausibility_[i] > clearly_plausible && from_best_[i] > clearly_different * std::sqrt(best + noise);
  verdict_ = result.misfit > images.misfit_limit ? Verdict::no_simulation_fits
             : several                           ? Verdict::ambiguous
                                                 : Verdict::matched;
}

void SurfaceFitter::update(HiddenCells& hidden) noexcept {
  hidden.remove_shown(frame_.cells());
  if (is_hidden_) hidden.add(best_.hidden_parts(frame_.cells(), views_.data()->depths));
}

}  // namespace lbea
