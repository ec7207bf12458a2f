#include "runtime/src/pose/pose_fit.hpp"

namespace lbea {
namespace {

// Weight of the silhouette's squares against those of the depths. Edges say little in each cell but, unlike a
// difference of shape, the same along the whole component.
constexpr float edge_weight = 3;

}  // namespace

[[gnu::cold]]  // compiled for size
PoseFit::PoseFit(const DepthCamera& camera, const PoseCenter& center, const DepthMetric& metric, std::size_t most)
    : code_(kernels()),
      squared_step_(camera.depth_step * camera.depth_step),
      one_sided_(prices_of(metric, camera).one_sided),
      noise_(double{metric.mesh_noise} / 3),
      derivatives_(camera, center, one_sided_),
      shares_(most * padded_cells(camera)),
      replaced_(shares_.size()),
      gram_(most * most),
      products_(6 * most),
      reduced_(6 * most),
      simplex_(most),
      ridge_(most),
      prices_(most),
      weights_(most),
      solved_(7 * most) {}

const PoseBelief& PoseFit::estimate(const PoseProblem& problem, const PoseBelief& prior,
                                    const FitSettings& settings) noexcept {
  k_ = problem.candidates.size();
  derivatives_.build(problem);
  add_up(problem);
  constexpr double usual = 1.0 / 30;  // per cell, until the bake has learned the variance
  const double learned = double{problem.images.pose_variance}, squared = double{least_square()} + noise_ * noise_;
  const double variance =
      squared * (learned > 0 ? learned / double{problem.cells} : usual);  // of a mean over the cells
  eliminate(prior, variance);
  combine(problem, settings);
  find_motion(prior);
  find_information();
  variance_ = 0;
  for (std::size_t i = 0; i < 36; ++i) {
    const double of_frame = posterior_.information[i] - variance * prior.information[i];
    variance_ += of_frame * posterior_.mean[i / 6] * posterior_.mean[i % 6] / 6 * double{problem.cells} / squared;
    posterior_.information[i] /= variance;
  }
  return posterior_;
}

/// Sums over the cells, as means in length units.
void PoseFit::add_up(const PoseProblem& problem) noexcept {
  const std::size_t cells = problem.observed.size();
  const auto of_depths = derivatives_.of_depths();
  const float scale = squared_step_ / problem.cells;
  edge_stride_ = padded_cells(derivatives_.edges().size());
  std::array<float, 6> row{};
  for (std::size_t i = 0; i < 6; ++i) {
    code_.project(of_depths.data(), 6, cells, &of_depths[i * cells], row.data());
    for (std::size_t j = 0; j < 6; ++j) normal_[6 * i + j] = double{scale} * double{row[j]};
  }
  for (const auto& edge : derivatives_.edges())
    for (std::size_t i = 0; i < 36; ++i)
      normal_[i] += double{edge_weight * scale} * double{edge.derivative[i / 6]} * double{edge.derivative[i % 6]};
  std::ranges::copy(problem.gram, gram_.begin());
  for (std::size_t i = 0; i < k_; ++i) {
    code_.project(of_depths.data(), 6, cells, &problem.residuals[i * cells], row.data());
    for (std::size_t m = 0; m < 6; ++m) products(i)[m] = scale * row[m];
    add_edges(problem, i);
  }
}

/// The shares of the cells at the silhouette replace their costs, but for differences of depth that count already.
void PoseFit::add_edges(const PoseProblem& problem, std::size_t candidate) noexcept {
  const auto edges = derivatives_.edges();
  const float scale = edge_weight * squared_step_ / problem.cells;
  const auto shares = std::span(shares_).subspan(candidate * edge_stride_, edge_stride_);
  const auto replaced = std::span(replaced_).subspan(candidate * edge_stride_, edge_stride_);
  const auto image = problem.images.of_sample(problem.candidates[candidate].sample);
  std::array<float, 6> sums{};
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const std::size_t cell = edges[e].cell;
    replaced[e] = edges[e].has_depth ? 0 : problem.residuals[candidate * problem.observed.size() + cell];
    shares[e] = one_sided_ * (share_of(image[cell]) - edges[e].share);
    for (std::size_t m = 0; m < 6; ++m) sums[m] += edges[e].derivative[m] * shares[e];
  }
  std::fill(shares.begin() + std::ssize(edges), shares.end(), 0.0f);
  std::fill(replaced.begin() + std::ssize(edges), replaced.end(), 0.0f);
  for (std::size_t m = 0; m < 6; ++m) products(candidate)[m] += scale * sums[m];
  const auto row = std::span(gram_).subspan(candidate * k_, candidate + 1);
  code_.project(shares_.data(), candidate + 1, edge_stride_, shares.data(), weights_.data());
  for (std::size_t j = 0; j <= candidate; ++j) row[j] += scale * weights_[j];
  code_.project(replaced_.data(), candidate + 1, edge_stride_, replaced.data(), weights_.data());
  for (std::size_t j = 0; j <= candidate; ++j) {
    row[j] -= scale / edge_weight * weights_[j];
    gram_[j * k_ + candidate] = row[j];
  }
}

float PoseFit::least_square() const noexcept {
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < k_; ++i) least = std::min(least, gram_[i * (k_ + 1)]);
  return std::max(least, 0.0f);
}

/// Leaves the squares that remain with the best motion in the Gram matrix.
void PoseFit::eliminate(const PoseBelief& prior, double weight) noexcept {
  PoseMotion expected{};  // J'J mean
  for (std::size_t i = 0; i < 36; ++i) {
    full_[i] = normal_[i] + weight * prior.information[i];
    expected[i / 6] += normal_[i] * prior.mean[i % 6];
  }
  double squared = 0;
  for (std::size_t m = 0; m < 6; ++m) squared += expected[m] * prior.mean[m];
  const PoseFactor factor(full_);
  for (std::size_t i = 0; i < k_; ++i) {
    double along = 0;
    PoseMotion b{};
    for (std::size_t m = 0; m < 6; ++m) {
      along += double{products(i)[m]} * prior.mean[m];
      b[m] = double{products(i)[m]} - expected[m];
    }
    b = factor.forward(b);
    std::ranges::transform(b, reduced(i).begin(), [](double value) { return static_cast<float>(value); });
    for (std::size_t j = 0; j < k_; ++j) {
      gram_[i * k_ + j] -= static_cast<float>(along);
      gram_[j * k_ + i] -= static_cast<float>(along);
    }
  }
  for (std::size_t i = 0; i < k_; ++i)
    for (std::size_t j = 0; j < k_; ++j) {
      float change = static_cast<float>(squared);
      for (std::size_t m = 0; m < 6; ++m) change -= reduced(i)[m] * reduced(j)[m];
      gram_[i * k_ + j] += change;
    }
}

/// The combination of SurfaceFitter, with the best motion for each weight.
void PoseFit::combine(const PoseProblem& problem, const FitSettings& settings) noexcept {
  const auto prices = std::span(prices_).first(k_);
  float mean = 0;
  for (std::size_t i = 0; i < k_; ++i) {
    prices[i] =
        settings.prices.residual * gram_[i * (k_ + 1)] + settings.prices.distance * square(problem.from_best[i]);
    mean += std::max(gram_[i * (k_ + 1)], 0.0f) / static_cast<float>(k_);
  }
  std::ranges::copy(simplex_.solve(gram_, k_, prices), weights_.begin());
  const float least = square(static_cast<float>(noise_));
  for (std::size_t i = 0; i < k_; ++i)
    prices[i] =
        settings.prices.change * (mean + least) + settings.prices.change_distance * square(problem.from_best[i]);
  ridge_.solve(gram_, k_, prices, std::span(weights_).first(k_));
}

void PoseFit::find_motion(const PoseBelief& prior) noexcept {
  PoseMotion sum{};
  for (std::size_t i = 0; i < k_; ++i)
    for (std::size_t m = 0; m < 6; ++m) sum[m] += double{weights_[i]} * double{reduced(i)[m]};
  posterior_.mean = PoseFactor(full_).backward(sum);
  for (std::size_t m = 0; m < 6; ++m) posterior_.mean[m] += prior.mean[m];
}

/// C' (G + P)^-1 C for weights that add up to 1, C the reduced products: what of each motion other weights explain.
PoseMatrix PoseFit::absorbed() noexcept {
  const auto solved = [this](std::size_t m) { return std::span(solved_).subspan(m * k_, k_); };
  std::array<double, 7> sums{};
  for (std::size_t m = 0; m < 7; ++m) {
    for (std::size_t i = 0; i < k_; ++i) solved(m)[i] = m < 6 ? double{reduced(i)[m]} : 1;
    ridge_.substitute(solved(m));
    for (const double value : solved(m)) sums[m] += value;
  }
  PoseMatrix absorbed{};
  for (std::size_t m = 0; m < 6; ++m)
    for (std::size_t i = 0; i < k_; ++i) {
      const double value = solved(m)[i] - sums[m] / sums[6] * solved(6)[i];
      for (std::size_t n = 0; n < 6; ++n) absorbed[6 * m + n] += value * double{reduced(i)[n]};
    }
  return absorbed;
}

/// The covariance of the motion is L'^-1 (1 + absorbed) L^-1, L L' = J'J with the prior: block-wise inversion.
void PoseFit::find_information() noexcept {
  const PoseFactor outer(full_);
  PoseMatrix covariance = absorbed();
  for (std::size_t i = 0; i < 6; ++i) covariance[7 * i] += 1;
  const PoseFactor inner(covariance);
  PoseMatrix rows{};  // per motion: inner^-1 L'
  for (std::size_t i = 0; i < 6; ++i) {
    PoseMotion row{};
    for (std::size_t j = 0; j < 6; ++j) row[j] = outer(i, j);
    std::ranges::copy(inner.forward(row), &rows[6 * i]);
  }
  posterior_.information = {};
  for (std::size_t i = 0; i < 36; ++i)
    for (std::size_t m = 0; m < 6; ++m) posterior_.information[i] += rows[i / 6 * 6 + m] * rows[i % 6 * 6 + m];
}

}  // namespace lbea
