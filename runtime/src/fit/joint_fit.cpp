#include "runtime/src/fit/joint_fit.hpp"

namespace lbea {
namespace {

// Residual of what explains all frames, relative to the rig's own best sample's. Of two rigs that see a run which is
// not in the ensemble, 99.5 % of the frames have less than 1.35.
constexpr float most_worse = 1.4f;

/// Several states of few runs differ by their times alone or belong to other deformation branches, whose small shares
/// add up: a combination needs a run's nearest state and those before and after it, but no fewer than for one rig.
std::uint32_t most_candidates(const FitSettings& settings, std::size_t runs, std::uint32_t samples) {
  constexpr std::size_t of_run = 3;
  const std::size_t most = std::min<std::size_t>(of_run * runs, settings.joint_candidates);
  return std::min(std::max(static_cast<std::uint32_t>(most), settings.candidates), samples);
}

/// Each rig's bake chooses its own costs. If each kept them, the rig with the larger ones would outweigh the others:
/// all are compared by the smallest ones.
const DepthMetric& common_metric(std::span<const RigEvidence> rigs) noexcept {
  const auto costs = [](const RigEvidence& rig) {
    return std::pair{rig.fitter->images().metric.cap, rig.fitter->images().metric.hidden};
  };
  return std::ranges::min_element(rigs, {}, costs)->fitter->images().metric;
}

}  // namespace

[[gnu::cold]]  // compiled for size
JointFitter::JointFitter(const ModelView& model, const DepthImages& images, std::size_t rigs, std::uint32_t max_matches,
                         const FitSettings& settings)
    : model_(model),
      regression_(images.regression),
      settings_(images.priced(settings)),
      noise_(square(images.metric.mesh_noise)),
      simulations_(model),
      proposed_(std::min<std::size_t>(rigs * settings.proposals, model.info.samples)),
      proposed_in_(model.info.samples),
      promising_(DepthRanking::most_promising),
      costs_(model, regression_),
      compared_(std::min<std::size_t>(rigs * promising_.capacity(), model.info.samples)),
      squares_(rigs * compared_.size()),
      depth_costs_(compared_.size()),
      best_(most_candidates(settings, simulations_.simulations(), model.info.samples)),
      candidates_(best_.capacity()),
      alone_(best_.capacity()),
      states_of_rig_(std::max<std::size_t>(best_.capacity(), settings.most_combined())),
      states_(rigs * states_of_rig_),
      of_rig_(rigs * best_.capacity()),
      gram_(best_.capacity() * best_.capacity()),
      rig_gram_(rigs * gram_.size()),
      pose_gram_(gram_.size()),
      estimate_(model, regression_, best_.capacity(), settings_),
      weights_(model, best_.capacity(), max_matches, images.metric.mesh_noise, settings_) {}

SurfaceFit JointFitter::fit(std::span<const RigEvidence> rigs, const FrameExpectation* expected) noexcept {
  SurfaceFit result;
  rigs_ = rigs;
  is_hidden_ = std::ranges::all_of(rigs_, [](const RigEvidence& rig) { return rig.fitter->is_hidden(); });
  propose();
  rank(expected);
  compare();
  estimate_.combine();
  estimate_.follow(predict());
  result.estimate = estimate_.samples();
  result.estimate_residual = estimate_.residual();
  result.residual = candidates_[0].distance;
  weights_.weigh(problem(), std::span(alone_).first(best_.ranked().size()), estimate_, result);
  judge(result);
  return result;
}

void JointFitter::begin_correction() noexcept {
  const std::size_t samples = estimate_.numbers().size();
  side_by_side(rigs_.size(), [&](std::size_t rig) {
    const auto& [fitter, index, later_s] = rigs_[rig];
    if (later_s == 0) return fitter->begin_correction(estimate_, *index);
    const auto states = std::span(states_).subspan(rig * states_of_rig_, samples);
    std::ranges::transform(estimate_.numbers(), states.begin(),
                           [&, later = later_s](std::uint32_t sample) { return simulations_.later(sample, later); });
    fitter->begin_correction(estimate_, *index, states);
  });
}

void JointFitter::correct(SurfaceFit& result) noexcept {
  begin_correction();
  SurfaceCorrection& correction = rigs_.front().fitter->correction();
  for (const RigEvidence& rig : rigs_.subspan(1)) correction.join(rig.fitter->correction());
  const auto weights = correction.solve(false);  // no sample alone
  if (weights.empty()) {
    for (const RigEvidence& rig : rigs_) rig.fitter->correction().clear();
    return;
  }
  estimate_.reweigh(weights);
  result.estimate = estimate_.samples();
  weights_.rank(estimate_.from_estimate(), 0, result);
}

/// Those that any rig's frame is compared with; first the ones that are good for one rig, or that only its earlier
/// frames propose.
void JointFitter::propose() noexcept {
  ++fits_;
  proposed_count_ = 0;
  const auto add = [this](const RigEvidence& rig, std::span<const RankedSample> proposals) {
    for (const RankedSample& one : proposals) {
      const std::uint32_t sample = simulations_.nearest_later(one.sample, -rig.later_s);
      if (proposed_in_[sample] == fits_) continue;
      proposed_in_[sample] = fits_;
      proposed_[proposed_count_++] = {sample, 0};
    }
  };
  for (const RigEvidence& rig : rigs_) {
    promising_.clear();
    for (const RankedSample& one : rig.fitter->search().proposed()) promising_.offer(one.sample, one.distance);
    add(rig, promising_.ranked());
  }
  compared_count_ = proposed_count_;
  for (const RigEvidence& rig : rigs_) add(rig, rig.fitter->search().proposed());
}

/// By the mean square over the cells of all images, and costs.
void JointFitter::rank(const FrameExpectation* expected) noexcept {
  const auto proposed = std::span(proposed_).first(compared_count_);
  const DepthMetric& metric = common_metric(rigs_);
  side_by_side(rigs_.size(), [&](std::size_t rig) {
    const auto& [fitter, index, later_s] = rigs_[rig];
    fitter->compare_again(metric);
    for (std::size_t i = 0; i < proposed.size(); ++i)
      squares_[rig * compared_.size() + i] =
          squares_of(*fitter, simulations_.nearest_later(proposed[i].sample, later_s));
  });
  costs_.assess(proposed, expected);
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < proposed.size(); ++i) {
    SquareSums all{.cells = 0, .shown = 0};
    for (std::size_t rig = 0; rig < rigs_.size(); ++rig) all += squares_[rig * compared_.size() + i];
    compared_[i] = {proposed[i].sample, all.mean()};
    depth_costs_[i] = all.mean_of_depths();
    least = std::min(least, compared_[i].distance);
  }
  if (is_hidden_)
    set_depth_costs(std::span(depth_costs_).first(proposed.size()), noise_);
  else
    std::ranges::fill(depth_costs_, 0.0f);
  price_per_cost_ = (least + noise_) / settings_.sharpness;
  best_.clear();
  for (std::size_t i = 0; i < proposed.size(); ++i) {
    const auto& [sample, mean] = compared_[i];
    best_.offer(sample, mean + price_per_cost_ * (costs_[sample] + depth_costs_[i]));
  }
  set_candidates();
}

/// What something may hide has a price only if no image shows it.
SquareSums JointFitter::squares_of(SurfaceFitter& fitter, std::uint32_t sample) const noexcept {
  SquareSums sums = fitter.squares_of(sample);
  if (!is_hidden_) sums.hidden = 0;
  return sums;
}

/// Part of the best one's mean square: see CandidateSearch.
float JointFitter::not_residual(std::uint32_t best) noexcept {
  float squares = 0, cells = 0;
  for (const auto& [fitter, index, later_s] : rigs_) {
    const std::uint32_t sample = simulations_.nearest_later(best, later_s);
    const SquareSums all = squares_of(*fitter, sample);
    squares += all.cells * std::max(all.mean() - fitter->shown_squares_of(sample).mean(), 0.0f);
    cells += all.cells;
  }
  return squares / cells;
}

void JointFitter::set_candidates() noexcept {
  const auto price = [this](const RankedSample& one) { return price_per_cost_ * costs_[one.sample]; };
  const auto length = [](float squared) { return std::sqrt(std::max(squared, 0.0f)); };
  const auto ranked = best_.ranked();
  const auto compared = std::span(compared_).first(compared_count_);
  const auto best = std::ranges::find(compared, ranked[0].sample, &RankedSample::sample) - compared.begin();
  const float of_best = price(ranked[0]);
  const float beside = not_residual(ranked[0].sample) + price_per_cost_ * depth_costs_[static_cast<std::size_t>(best)];
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    candidates_[i] = {model_.sample(ranked[i].sample), length(ranked[i].distance - of_best - beside)};
    alone_[i] = length(ranked[i].distance - price(ranked[i]) - beside);
  }
}

void JointFitter::compare() noexcept {
  const std::size_t all = best_.ranked().size(), k = std::min<std::size_t>(all, settings_.candidates);
  std::array<std::span<const float>, most_rigs> grams;
  side_by_side(rigs_.size(), [&](std::size_t rig) { grams[rig] = compare_at(rig, rigs_[rig].later_s); });
  cells_ = 0;
  for (const RigEvidence& rig : rigs_) cells_ += rig.fitter->residuals().filled();
  std::ranges::fill(gram_, 0.0f);
  for (std::size_t rig = 0; rig < rigs_.size(); ++rig) {
    const float scale = square(rigs_[rig].fitter->images().camera.depth_step) / cells_;
    for (std::size_t i = 0; i < grams[rig].size(); ++i) gram_[i] += scale * grams[rig][i];
  }
  for (std::size_t i = 0; i < k; ++i) std::copy_n(&gram_[i * all], k, &pose_gram_[i * k]);
  estimate_.begin(problem());
}

/// Sets the residuals of a rig's frame. Returns their products, squared depth steps.
std::span<const float> JointFitter::compare_at(std::size_t rig, double later_s) noexcept {
  const auto ranked = best_.ranked();
  ImageResiduals& residuals = rigs_[rig].fitter->residuals();
  const auto states = std::span(states_).subspan(rig * states_of_rig_, ranked.size());
  const auto gram = std::span(rig_gram_).subspan(rig * gram_.size(), ranked.size() * ranked.size());
  std::ranges::transform(ranked, states.begin(),
                         [&](const RankedSample& one) { return simulations_.later(one.sample, later_s); });
  residuals.compare(states, is_hidden_);
  std::ranges::fill(gram, 0.0f);
  residuals.add_products(1, gram);
  return gram;
}

double JointFitter::lag_of(std::size_t rig, double step_s) noexcept {
  const auto shares = estimate_.shares();
  std::array<double, 3> squares{};  // of the combination a step earlier, at the frame's time, a step later
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const auto gram = compare_at(rig, rigs_[rig].later_s + (static_cast<double>(i) - 1) * step_s);
    for (std::size_t j = 0; j < gram.size(); ++j)
      squares[i] += double{shares[j / shares.size()] * shares[j % shares.size()]} * double{gram[j]};
  }
  if (!(squares[1] < squares[0] && squares[1] < squares[2])) return std::numeric_limits<double>::quiet_NaN();
  return step_s / 2 * (squares[0] - squares[2]) / (squares[0] - 2 * squares[1] + squares[2]);
}

/// By as many candidates as for one rig: more of them take longer and give no better pose.
const PoseBelief& JointFitter::pose_of(std::size_t rig, const PoseBelief& prior) noexcept {
  const std::size_t k = std::min<std::size_t>(best_.ranked().size(), settings_.candidates);
  const auto samples = std::span(of_rig_).subspan(rig * best_.capacity(), k);
  std::ranges::transform(best_.ranked().first(k), samples.begin(), [&](const RankedSample& one) {
    return RankedSample{simulations_.nearest_later(one.sample, rigs_[rig].later_s), one.distance};
  });
  EstimateProblem of_rig = problem();
  of_rig.samples = samples;
  of_rig.gram = std::span(pose_gram_).first(k * k);
  return rigs_[rig].fitter->pose_by(of_rig, estimate_.from_best().first(k), cells_, prior);
}

EstimateProblem JointFitter::problem() const noexcept {
  const std::size_t k = best_.ranked().size();
  return {.samples = best_.ranked(),
          .candidates = std::span(candidates_).first(k),
          .gram = std::span(gram_).first(k * k),
          .proposed = std::span(proposed_).first(proposed_count_),
          .is_hidden = is_hidden_};
}

/// That of a completed image repeats the candidates in part: it counts only if all images are hidden in part.
bool JointFitter::predicts(const RigEvidence& rig) const noexcept { return is_hidden_ || !rig.fitter->is_hidden(); }

/// The mean of the rigs' predictions, weighted by the inverse of their variance and by how much each rig shows. The
/// variance is in proportion to the square of the bound of the rig's own estimate or, if the bakes have not learned
/// bounds, of how far predictions usually are from the candidates.
ShapePrediction JointFitter::predict() noexcept {
  ShapePrediction mean;
  float all = 0;
  scores_ = {};
  const bool has_bounds = std::ranges::all_of(
      rigs_, [this](const RigEvidence& rig) { return !predicts(rig) || std::isfinite(rig.fitter->error_90()); });
  for (const RigEvidence& rig : rigs_) {
    if (!predicts(rig)) continue;
    const ShapePrediction one = rig.fitter->predict_again(estimate_.shares());
    if (one.scores.empty() || !(one.most_difference > 0)) continue;
    const float shown =
        std::min(rig.fitter->shown_share(simulations_.nearest_later(best_.ranked()[0].sample, rig.later_s)), 1.0f);
    const float weight = shown / (has_bounds ? square(rig.fitter->error_90()) + noise_ : square(one.most_difference));
    for (std::size_t i = 0; i < scores_.size(); ++i) scores_[i] += weight * one.scores[i];
    add_earlier(rig, weight);
    mean.blend += weight * one.blend;
    mean.most_difference += weight * one.most_difference;
    all += weight;
  }
  if (!(all > 0)) return {};
  for (float& score : scores_) score /= all;
  return {scores_, mean.blend / all, mean.most_difference / all};
}

/// Adds how much the candidates' combination changes from the time of a rig's frame to that of the joint shape.
void JointFitter::add_earlier(const RigEvidence& rig, float weight) noexcept {
  if (rig.later_s == 0) return;
  for (std::size_t i = 0; i < best_.ranked().size(); ++i) {
    const auto [sample, next, share] = simulations_.later(best_.ranked()[i].sample, rig.later_s);
    const auto own = regression_.shape(best_.ranked()[i].sample), a = regression_.shape(sample),
               b = regression_.shape(next);
    const float part = weight * estimate_.shares()[i];
    for (std::size_t j = 0; j < scores_.size(); ++j) scores_[j] += part * (own[j] - a[j] - share * (b[j] - a[j]));
  }
}

/// As SurfaceFitter, with means over the cells of all images; so are the limit and the bound, which the bakes have
/// learned for single images.
void JointFitter::judge(SurfaceFit& result) noexcept {
  const std::uint32_t best = best_.ranked()[weights_.best_alone()].sample;
  float squares = 0, expected = 0, limit = 0, shown = 0, per_spread = 0, bounded = 0;
  bool gives_verdicts = true;
  is_contradictory_ = false;
  for (const auto& [fitter, index, later_s] : rigs_) {
    const float share = fitter->residuals().filled() / cells_,
                square = fitter->judged_square(simulations_.nearest_later(best, later_s));
    const float own = fitter->judged_square(fitter->search().sample(0));
    is_contradictory_ |= square + noise_ > most_worse * most_worse * (own + noise_);
    squares += share * square;
    expected += share * weights_.plausible_mean([&, of = fitter, later = later_s](std::uint32_t sample) {
      return lbea::square(of->views().expected_residual(simulations_.nearest_later(sample, later)));
    });
    limit += share * fitter->images().misfit_limit;
    const float shown_by_rig = std::min(fitter->shown_share(simulations_.nearest_later(best, later_s)), 1.0f);
    shown += share * shown_by_rig;
    gives_verdicts = gives_verdicts && fitter->gives_verdicts() && !fitter->is_sparse(shown_by_rig);
    if (fitter->is_hidden() != is_hidden_) continue;
    per_spread += share * static_cast<float>(fitter->error_bound().per_spread_at(double{result.spread}));
    bounded += share;
  }
  verdict_ = Verdict::unknown;
  if (!gives_verdicts || shown < least_judged) return;
  if (per_spread > 0 && (shown >= least_bounded || !is_hidden_)) result.error_90 = per_spread / bounded * result.spread;
  result.misfit = std::sqrt((squares + noise_) / (expected + noise_));
  verdict_ = weights_.verdict(result.misfit, limit, estimate_.from_best());
}

}  // namespace lbea
