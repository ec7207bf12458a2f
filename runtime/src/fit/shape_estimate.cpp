#include "runtime/src/fit/shape_estimate.hpp"

#include <functional>

namespace lbea {
namespace {

constexpr std::size_t block = 16;  // neighbors whose products are summed together, in registers

}  // namespace

[[gnu::cold]]  // compiled for size
ShapeEstimate::ShapeEstimate(const ModelView& model, const ShapeRegression& regression, std::size_t most,
                             const FitSettings& settings)
    : model_(model),
      code_(kernels()),
      regression_(regression),
      settings_(settings),
      shapes_(model),
      landmark_buffer_((most + 1) * shapes_.size()),
      landmarks_(most),
      from_best_(most),
      from_estimate_(most),
      nearest_(most_nearest),
      linear_(most),
      shares_(most),
      simplex_(most),
      ridge_(most),
      target_(ShapeRegression::shape_scores),
      neighbors_(std::min(settings.neighbors, model.info.samples)),
      offsets_(neighbors_.capacity() * ShapeRegression::shape_scores),
      by_score_((neighbors_.capacity() + block) * ShapeRegression::shape_scores),
      neighbor_gram_(neighbors_.capacity() * neighbors_.capacity()),
      weights_(neighbors_.capacity()),
      prices_(neighbors_.capacity()),
      neighbor_ridge_(neighbors_.capacity()),
      samples_(std::max<std::size_t>(most, neighbors_.capacity())),
      numbers_(samples_.size()),
      estimate_landmarks_(shapes_.size()) {}

void ShapeEstimate::begin(const EstimateProblem& problem) noexcept {
  problem_ = problem;
  for (std::size_t i = 0; i < count(); ++i) {
    landmarks_[i] = shapes_.of(problem_.samples[i].sample, problem_.reads_copies, buffer(i));
    from_best_[i] = shapes_.mean_distance(landmarks_[i], landmarks_[0]);
  }
}

void ShapeEstimate::combine() noexcept {
  combine_candidates();                    // convex, with the least residual
  if (!problem_.is_hidden) extrapolate();  // the estimate may lie beside the samples
  residual_ = residual_of_combination();
}

void ShapeEstimate::follow(const ShapePrediction& prediction) noexcept {
  use_candidates();
  if (!prediction.scores.empty()) {
    move_toward(prediction);
    use_neighbors();
  }
  measure_candidates();
}

void ShapeEstimate::reweigh(std::span<const float> weights) noexcept {
  const std::size_t count_used = used_;
  const double time = time_s_;
  clear();
  for (std::size_t i = 0; i < count_used; ++i)
    if (weights[i] != 0) use(numbers_[i], weights[i], shapes_.of(numbers_[i], problem_.reads_copies, buffer(count())));
  time_s_ = time;
  measure_candidates();
}

void ShapeEstimate::measure_candidates() noexcept {
  nearest_.clear();
  for (std::size_t i = 0; i < count(); ++i) {
    from_estimate_[i] = shapes_.mean_distance(landmarks_[i], estimate_landmarks_);
    nearest_.offer(problem_.samples[i].sample, from_estimate_[i]);
  }
}

void ShapeEstimate::combine_candidates() noexcept {
  const std::size_t k = count();
  for (std::size_t i = 0; i < k; ++i) {
    const float residual = problem_.candidates[i].distance, distance = from_best_[i];
    linear_[i] = settings_.prices.residual * residual * residual + settings_.prices.distance * distance * distance;
  }
  const auto w = simplex_.solve(problem_.gram, k, std::span<const float>(linear_).first(k));
  std::ranges::copy(w, shares_.begin());
}

void ShapeEstimate::extrapolate() noexcept {
  const std::size_t k = count();
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) mean += problem_.gram[i * k + i] / static_cast<float>(k);
  for (std::size_t i = 0; i < k; ++i)
    linear_[i] = settings_.prices.change * mean + settings_.prices.change_distance * square(from_best_[i]);
  if (mean > 0) ridge_.solve(problem_.gram, k, std::span(linear_).first(k), std::span(shares_).first(k));
}

float ShapeEstimate::residual_of_combination() const noexcept {
  const std::size_t k = count();
  float squared = 0;
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j < k; ++j) squared += shares_[i] * shares_[j] * problem_.gram[i * k + j];
  return std::sqrt(std::max(squared, 0.0f));
}

void ShapeEstimate::use_candidates() noexcept {
  clear();
  for (std::size_t i = 0; i < count(); ++i)
    if (shares_[i] != 0) use(problem_.samples[i].sample, shares_[i], landmarks_[i]);
}

void ShapeEstimate::clear() noexcept {
  used_ = 0;
  std::ranges::fill(estimate_landmarks_, 0.0f);
  shape_ = {};
  time_s_ = 0;
}

void ShapeEstimate::use(std::uint32_t sample, float weight, std::span<const float> landmarks) noexcept {
  numbers_[used_] = sample;
  samples_[used_++] = {model_.sample(sample), weight};
  code_.add_multiple(weight, landmarks.data(), estimate_landmarks_.size(), estimate_landmarks_.data());
  if (regression_.blend > 0) code_.add_multiple(weight, regression_.shape(sample).data(), shape_.size(), shape_.data());
  if (!model_.sample_times.empty()) time_s_ += double{weight} * model_.sample_times[sample];
}

/// Sets the target. Predictions far from the candidates' combination, of a frame unlike all training images for
/// example, move it no further than usual ones.
void ShapeEstimate::move_toward(const ShapePrediction& prediction) noexcept {
  const auto& [predicted, blend, most] = prediction;
  std::ranges::fill(target_, 0.0f);
  for (std::size_t i = 0; i < count(); ++i)
    code_.add_multiple(shares_[i], regression_.shape(problem_.samples[i].sample).data(), target_.size(),
                       target_.data());
  const float difference = std::sqrt(squared_distance(predicted, target_));
  if (!std::isfinite(difference)) return;  // by a forged model
  const float share = blend * std::min(1.0f, most / std::max(difference, 1e-30f));
  for (std::size_t i = 0; i < target_.size(); ++i) target_[i] += share * (predicted[i] - target_[i]);
}

// The candidates do not span all shapes near them: more samples, near the target, represent it better.
void ShapeEstimate::use_neighbors() noexcept {
  neighbors_.clear();
  for (const RankedSample& proposal : problem_.proposed)
    neighbors_.offer(proposal.sample, squared_distance(regression_.shape(proposal.sample), target_));
  const std::size_t k = neighbors_.ranked().size();
  const float price = settings_.prices.neighbor * compare_neighbors();
  if (!(price >= std::numeric_limits<float>::min())) return;  // all neighbors have the same shape
  std::ranges::fill(prices_, price);
  std::ranges::fill(weights_, 1 / static_cast<float>(k));
  neighbor_ridge_.solve(neighbor_gram_, k, std::span(prices_).first(k), std::span(weights_).first(k));
  clear();
  for (std::size_t i = 0; i < k; ++i) {
    const std::uint32_t sample = neighbors_.ranked()[i].sample;
    use(sample, weights_[i], shapes_.of(sample, problem_.reads_copies, buffer(count())));
  }
}

/// Sets the products of their offsets from the target. Returns the mean square of the offsets.
float ShapeEstimate::compare_neighbors() noexcept {
  constexpr std::size_t scores = ShapeRegression::shape_scores;
  const std::size_t k = neighbors_.ranked().size(), stride = k + block;
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) {
    const RankedSample& neighbor = neighbors_.ranked()[i];
    std::ranges::transform(regression_.shape(neighbor.sample), target_, &offsets_[i * scores], std::minus<>{});
    for (std::size_t score = 0; score < scores; ++score) by_score_[score * stride + i] = offsets_[i * scores + score];
    mean += neighbor.distance / static_cast<float>(k);
  }
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t begin = i; begin < k; begin += block) {
      std::array<float, block> sums{};
      for (std::size_t score = 0; score < scores; ++score)
        for (std::size_t j = 0; j < block; ++j)
          sums[j] += offsets_[i * scores + score] * by_score_[score * stride + begin + j];
      for (std::size_t j = begin; j < std::min(begin + block, k); ++j)
        neighbor_gram_[i * k + j] = neighbor_gram_[j * k + i] = sums[j - begin];
    }
  return mean;
}

}  // namespace lbea
