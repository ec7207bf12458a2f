#include "runtime/src/match/surface_fit.hpp"

#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/sample_surface.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

std::vector<std::uint32_t> spread_out(std::uint32_t nodes) {
  const std::uint32_t count = format::mesh_landmarks(nodes);
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < count; ++i) chosen.push_back(format::part_begin(i, count, nodes));
  return chosen;
}

}  // namespace

SurfaceFitter::SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches,
                             const FitSettings& settings)
    : model_(model),
      views_(std::move(views)),
      settings_(settings),
      code_(kernels()),
      frame_(views_.data()->camera),
      best_(views_.data()->camera, std::min(settings.candidates, model.info.samples), settings.metric),
      matches_(std::min<std::uint32_t>(max_matches, static_cast<std::uint32_t>(best_.capacity()))),
      matched_(matches_.capacity()),
      residuals_(best_.capacity() * padded_cells(views_.data()->camera)),
      gram_(best_.capacity() * best_.capacity()),
      products_(best_.capacity()),
      linear_(best_.capacity()),
      simplex_(best_.capacity()),
      landmark_nodes_(spread_out(model.info.nodes)),
      landmark_floats_(3 * landmark_nodes_.size()),
      landmarks_(best_.capacity() * landmark_floats_),
      estimate_landmarks_(landmark_floats_),
      from_best_(best_.capacity()),
      from_estimate_(best_.capacity()),
      plausibility_(best_.capacity()),
      shares_(best_.capacity()),
      candidates_(best_.capacity()),
      estimate_(best_.capacity()) {}

SurfaceFit SurfaceFitter::fit(const CloudIndex& index, std::span<const RankedSample> proposed) noexcept {
  SurfaceFit result;
  frame_.build(index);          // what the sensor saw
  choose_candidates(proposed);  // ... against what it would see
  combine_candidates();         // the shape between them
  weigh(result);
  judge(result);
  return result;
}

void SurfaceFitter::choose_candidates(std::span<const RankedSample> proposed) noexcept {
  const ViewData& views = *views_.data();
  best_.rank(frame_.cells(), views.depths, proposed);
  const float step = views.camera.depth_step;
  for (std::size_t k = 0; k < count(); ++k) {
    const RankedSample& sample = best_.ranked()[k];
    candidates_[k] = {{model_.samples[sample.sample][0], model_.samples[sample.sample][1]},
                      step * std::sqrt(sample.distance)};
    take_landmarks(sample.sample, landmarks(k));
  }
}

// Residuals of blended samples are taken as blends of their residuals: true along a line of sight that meets the same
// surface in all of them. Where only some fill a cell, the blend fills a part of it.
void SurfaceFitter::combine_candidates() noexcept {
  const ViewData& views = *views_.data();
  const std::size_t k = count(), cells = padded_cells(views.camera);
  for (std::size_t i = 0; i < k; ++i)
    code_.subtract_views(frame_.cells().data(), views.of_sample(best_.ranked()[i].sample).data(), cells, best_.prices(),
                         &residuals_[i * cells]);
  const auto image = views.of_sample(best_.ranked()[0].sample);
  filled_ = std::max(code_.compare_views(frame_.cells().data(), image.data(), cells, best_.prices()).filled, 1.0f);
  const float scale = views.camera.depth_step * views.camera.depth_step / filled_;  // to a mean square in length units
  for (std::size_t i = 0; i < k; ++i) {
    code_.project(residuals_.data(), i + 1, cells, &residuals_[i * cells], products_.data());
    for (std::size_t j = 0; j <= i; ++j) gram_[i * k + j] = gram_[j * k + i] = scale * products_[j];
  }
  for (std::size_t i = 0; i < k; ++i) {
    from_best_[i] = mean_distance(landmarks(i), landmarks(0));
    linear_[i] = settings_.residual_price * candidates_[i].distance * candidates_[i].distance +
                 settings_.distance_price * from_best_[i] * from_best_[i];
  }
  const auto w = simplex_.solve(gram_, k, std::span<const float>(linear_).first(k));
  std::ranges::copy(w, shares_.begin());
}

void SurfaceFitter::weigh(SurfaceFit& result) noexcept {
  const std::size_t k = count();
  std::size_t used = 0;
  std::ranges::fill(estimate_landmarks_, 0.0f);
  float squared = 0;
  for (std::size_t i = 0; i < k; ++i) {
    if (!(shares_[i] > 0)) continue;
    estimate_[used++] = {candidates_[i].sample, shares_[i]};
    const auto from = landmarks(i);
    for (std::size_t c = 0; c < from.size(); ++c) estimate_landmarks_[c] += shares_[i] * from[c];
    for (std::size_t j = 0; j < k; ++j) squared += shares_[i] * shares_[j] * gram_[i * k + j];
  }
  for (std::size_t i = 0; i < k; ++i) from_estimate_[i] = mean_distance(landmarks(i), estimate_landmarks_);
  rank();
  result.candidates = std::span<const Match>(candidates_).first(k);
  result.estimate = std::span<const WeightedSample>(estimate_).first(used);
  result.residual = candidates_[0].distance;
  result.estimate_residual = std::sqrt(std::max(squared, 0.0f));
}

void SurfaceFitter::rank() noexcept {
  const auto square = [](float v) { return v * v; };
  matches_.clear();
  for (std::uint32_t i = 0; i < count(); ++i)
    matches_.offer(i, square(from_estimate_[i]) + settings_.residual_rank * square(candidates_[i].distance));
  std::ranges::transform(matches_.ranked(), matched_.begin(), [this](const RankedSample& match) {
    return RankedSample{best_.ranked()[match.sample].sample, from_estimate_[match.sample]};
  });
}

void SurfaceFitter::judge(SurfaceFit& result) noexcept {
  const ViewData& views = *views_.data();
  const auto square = [](float v) { return v * v; };
  const float noise = square(settings_.metric.mesh_noise), best = square(result.residual);
  float all = 0, expected = 0, spread = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    plausibility_[i] = std::exp(-settings_.sharpness * (square(candidates_[i].distance) - best) / (best + noise));
    all += plausibility_[i];
    expected += plausibility_[i] * square(views.expected[best_.ranked()[i].sample]);
    spread += plausibility_[i] * from_estimate_[i];
  }
  result.spread = spread / all;
  result.misfit = std::sqrt((best + noise) / (expected / all + noise));
  constexpr float clearly_plausible = 0.5f, clearly_different = 1.5f;  // of the best's plausibility; of its residual
  bool several = false;
  for (std::size_t i = 1; i < count(); ++i)
    several |= candidates_[i].sample.simulation != candidates_[0].sample.simulation &&
               plausibility_[i] > clearly_plausible && from_best_[i] > clearly_different * std::sqrt(best + noise);
  verdict_ = result.misfit > views.misfit_limit ? Verdict::no_simulation_fits
             : several                          ? Verdict::ambiguous
                                                : Verdict::matched;
}

void SurfaceFitter::take_landmarks(std::uint32_t sample, std::span<float> into) const noexcept {
  if (!model_.landmark_positions.empty()) {
    std::ranges::copy(mesh_landmarks(model_, sample), into.begin());
    return;
  }
  const float* positions = model_.node_positions.data() + std::size_t{3} * model_.info.nodes * sample;
  for (std::size_t i = 0; i < landmark_nodes_.size(); ++i)
    std::copy_n(positions + std::size_t{3} * landmark_nodes_[i], 3, &into[3 * i]);
}

float SurfaceFitter::mean_distance(std::span<const float> a, std::span<const float> b) const noexcept {
  float sum = 0;
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const float x = a[i] - b[i], y = a[i + 1] - b[i + 1], z = a[i + 2] - b[i + 2];
    sum += std::sqrt(x * x + y * y + z * z);
  }
  return sum / static_cast<float>(landmark_nodes_.size());
}

}  // namespace lbea
