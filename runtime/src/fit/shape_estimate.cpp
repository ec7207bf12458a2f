#include "runtime/src/fit/shape_estimate.hpp"

#include <bit>
#include <functional>

namespace lbea {
namespace {

void add(float weight, std::span<const float> values, std::span<float> sum) noexcept {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * values[i];
}

}  // namespace

[[gnu::cold]]  // compiled for size
ShapeEstimate::ShapeEstimate(const ModelView& model, const DepthImages& images, CandidateSearch& search,
                             const FitSettings& settings)
    : model_(model),
      images_(images),
      search_(search),
      settings_(settings),
      code_(kernels()),
      shapes_(model),
      landmark_buffer_((search.capacity() + 1) * shapes_.size()),
      landmarks_(search.capacity()),
      from_best_(search.capacity()),
      from_estimate_(search.capacity()),
      residuals_(search.capacity() * padded_cells(images.camera)),
      gathered_(residuals_.size()),
      gram_(search.capacity() * search.capacity()),
      products_(search.capacity()),
      linear_(search.capacity()),
      shares_(search.capacity()),
      simplex_(search.capacity()),
      ridge_(search.capacity()),
      predictor_(images),
      completed_(images.camera),
      target_(ShapeRegression::shape_scores),
      neighbors_(std::min(settings.neighbors, model.info.samples)),
      offsets_(neighbors_.capacity() * ShapeRegression::shape_scores),
      by_score_(offsets_.size()),
      neighbor_gram_(neighbors_.capacity() * neighbors_.capacity()),
      weights_(neighbors_.capacity()),
      prices_(neighbors_.capacity()),
      neighbor_ridge_(neighbors_.capacity()),
      samples_(std::max(search.capacity(), neighbors_.capacity())),
      estimate_landmarks_(shapes_.size()) {
  lines_.reserve(padded_cells(images.camera));
}

// The residual of a combination is approximated by the combination of the residuals. That is exact along a line of
// sight that meets the same surface in all samples. A cell that only some samples fill counts with their share.
void ShapeEstimate::compare() noexcept {
  const FrameImage& frame = search_.image();
  const std::size_t k = count(), cells = padded_cells(images_.camera);
  const float* observed = frame.observed.data();
  const CellPrices& prices = search_.ranking().prices();
  filled_ = code_.compare_depths(observed, search_.image_of(0).data(), cells, prices).filled;
  for (std::size_t i = 0; i < k; ++i) {
    code_.subtract_depths(observed, search_.image_of(i).data(), cells, prices, residuals(i).data());
    if (!frame.is_hidden) continue;
    const float hidden = search_.ranking().price_hidden(frame.observed, search_.image_of(i), residuals(i));
    if (i == 0) filled_ -= hidden;
  }
  filled_ = std::max(filled_, 1.0f);
  const float scale = square(images_.camera.depth_step) / filled_;  // to a mean square in length units
  const std::size_t stride = gather_residuals(cells);
  for (std::size_t i = 0; i < k; ++i) {
    code_.project(gathered_.data(), i + 1, stride, &gathered_[i * stride], products_.data());
    for (std::size_t j = 0; j <= i; ++j) gram_[i * k + j] = gram_[j * k + i] = scale * products_[j];
  }
  for (std::size_t i = 0; i < k; ++i) {
    landmarks_[i] = shapes_.of(search_.sample(i), search_.reads_copies(), buffer(i));
    from_best_[i] = shapes_.mean_distance(landmarks_[i], landmarks_[0]);
  }
}

/// Copies the residuals without the lines of cells at which all are zero. Returns the number of cells that remain.
std::size_t ShapeEstimate::gather_residuals(std::size_t cells) noexcept {
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
PoseProblem ShapeEstimate::pose_problem() const noexcept {
  const FrameImage& image = search_.image();
  return {.observed = image.observed,
          .points = image.points,
          .in_all = search_.ranking().in_all(),
          .images = images_,
          .candidates = search_.ranking().ranked(),
          .residuals = residuals_,
          .gram = std::span(gram_).first(count() * count()),
          .from_best = from_best_,
          .cells = filled_,
          .has_silhouette = !image.is_hidden};
}

void ShapeEstimate::combine(std::span<const float> predicted) noexcept {
  combine_candidates();                           // convex, with the least residual
  if (!search_.image().is_hidden) extrapolate();  // the estimate may lie beside the samples
  residual_ = residual_of_combination();
  use_candidates();
  if (search_.image().is_hidden) predicted = predict_hidden(predicted);
  if (!predicted.empty()) {
    move_toward(predicted);
    use_neighbors();
  }
  for (std::size_t i = 0; i < count(); ++i)
    from_estimate_[i] = shapes_.mean_distance(landmarks_[i], estimate_landmarks_);
}

void ShapeEstimate::combine_candidates() noexcept {
  const std::size_t k = count();
  for (std::size_t i = 0; i < k; ++i) {
    const float residual = search_.candidates()[i].distance, distance = from_best_[i];
    linear_[i] = settings_.residual_price * residual * residual + settings_.distance_price * distance * distance;
  }
  const auto w = simplex_.solve(gram_, k, std::span<const float>(linear_).first(k));
  std::ranges::copy(w, shares_.begin());
}

void ShapeEstimate::extrapolate() noexcept {
  const std::size_t k = count();
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) mean += gram_[i * k + i] / static_cast<float>(k);
  for (std::size_t i = 0; i < k; ++i)
    linear_[i] = settings_.change_price * mean + settings_.change_distance_price * square(from_best_[i]);
  if (mean > 0) ridge_.solve(gram_, k, std::span(linear_).first(k), std::span(shares_).first(k));
}

float ShapeEstimate::residual_of_combination() const noexcept {
  const std::size_t k = count();
  float squared = 0;
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j < k; ++j) squared += shares_[i] * shares_[j] * gram_[i * k + j];
  return std::sqrt(std::max(squared, 0.0f));
}

void ShapeEstimate::use_candidates() noexcept {
  begin();
  for (std::size_t i = 0; i < count(); ++i)
    if (shares_[i] != 0) use(search_.sample(i), shares_[i], landmarks_[i]);
}

void ShapeEstimate::begin() noexcept {
  used_ = 0;
  std::ranges::fill(estimate_landmarks_, 0.0f);
  shape_ = {};
  time_s_ = 0;
}

void ShapeEstimate::use(std::uint32_t sample, float weight, std::span<const float> landmarks) noexcept {
  samples_[used_++] = {model_.sample(sample), weight};
  add(weight, landmarks, estimate_landmarks_);
  if (images_.regression.blend > 0) add(weight, images_.regression.shape(sample), shape_);
  if (!model_.sample_times.empty()) time_s_ += double{weight} * model_.sample_times[sample];
}

/// The shape predicted from the completed image, unless it is known.
std::span<const float> ShapeEstimate::predict_hidden(std::span<const float> predicted) noexcept {
  completed_.clear();
  for (std::size_t i = 0; i < count(); ++i)
    if (shares_[i] != 0)
      completed_.add(shares_[i], search_.image_of(i), residuals(i), search_.ranking().hidden_price());
  completed_.finish(search_.image().observed);
  if (!predicted.empty() || images_.regression.hidden_blend == 0) return predicted;
  return predictor_.predict(completed_.cells());
}

/// Sets the target. Predictions far from the candidates' combination, of a frame unlike all training images for
/// example, move it no further than usual ones.
void ShapeEstimate::move_toward(std::span<const float> predicted) noexcept {
  const ShapeRegression& regression = images_.regression;
  const bool is_hidden = search_.image().is_hidden;
  const float blend = is_hidden ? regression.hidden_blend : regression.blend;
  const float most = is_hidden ? regression.hidden_most_difference : regression.most_difference;
  std::ranges::fill(target_, 0.0f);
  for (std::size_t i = 0; i < count(); ++i) add(shares_[i], regression.shape(search_.sample(i)), target_);
  const float difference = std::sqrt(squared_distance(predicted, target_));
  if (!std::isfinite(difference)) return;  // by a forged model
  const float share = blend * std::min(1.0f, most / std::max(difference, 1e-30f));
  for (std::size_t i = 0; i < target_.size(); ++i) target_[i] += share * (predicted[i] - target_[i]);
}

// The candidates do not span all shapes near them: more samples, near the target, represent it better.
void ShapeEstimate::use_neighbors() noexcept {
  neighbors_.clear();
  for (const RankedSample& proposal : search_.proposed())
    neighbors_.offer(proposal.sample, squared_distance(images_.regression.shape(proposal.sample), target_));
  const std::size_t k = neighbors_.ranked().size();
  const float price = settings_.neighbor_price * compare_neighbors();
  if (!(price >= std::numeric_limits<float>::min())) return;  // all neighbors have the same shape
  std::ranges::fill(prices_, price);
  std::ranges::fill(weights_, 1 / static_cast<float>(k));
  neighbor_ridge_.solve(neighbor_gram_, k, std::span(prices_).first(k), std::span(weights_).first(k));
  begin();
  for (std::size_t i = 0; i < k; ++i) {
    const std::uint32_t sample = neighbors_.ranked()[i].sample;
    use(sample, weights_[i], shapes_.of(sample, search_.reads_copies(), buffer(count())));
  }
}

/// Sets the products of their offsets from the target. Returns the mean square of the offsets.
float ShapeEstimate::compare_neighbors() noexcept {
  constexpr std::size_t scores = ShapeRegression::shape_scores;
  const std::size_t k = neighbors_.ranked().size();
  float mean = 0;
  for (std::size_t i = 0; i < k; ++i) {
    const RankedSample& neighbor = neighbors_.ranked()[i];
    std::ranges::transform(images_.regression.shape(neighbor.sample), target_, &offsets_[i * scores], std::minus<>{});
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
  return mean;
}

}  // namespace lbea
