#include "precompute/depth_images/shape_training.hpp"

#include "precompute/dense/symmetric_eigenpairs.hpp"
#include "precompute/dense/symmetric_inverse.hpp"
#include "precompute/left_out/branches.hpp"
#include "precompute/rig/counter_random.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::bake {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd;

constexpr std::size_t compared_nodes = 128;  // of a shape, at most
constexpr std::array regularizations{1e-4, 1e-3, 1e-2};

/// At most 512 of `count` rows: enough to compute principal components.
std::vector<std::size_t> snapshots_of(std::size_t count) {
  return spread_samples(std::min<std::size_t>(512, count), count);
}

/// Principal components of the rows, whose mean is 0, one per column; zeros beyond their rank. By the method of
/// snapshots (Sirovich 1987): from the rows' Gram matrix.
MatrixXd principal_components(const MatrixXd& snapshots, std::size_t most) {
  const Index count = snapshots.rows();
  const Eigenpairs pairs = eigenpairs_of_symmetric(snapshots * snapshots.transpose());
  const double largest = pairs.values(count - 1);
  MatrixXd components = MatrixXd::Zero(snapshots.cols(), static_cast<Index>(most));
  for (Index k = 0; k < std::min(count, components.cols()); ++k) {
    const double eigenvalue = pairs.values(count - 1 - k);
    if (!(eigenvalue > 1e-10 * largest)) break;
    components.col(k) = snapshots.transpose() * pairs.vectors.col(count - 1 - k) / std::sqrt(eigenvalue);
  }
  return components;
}

/// Six times the median distance of an image from its 24th nearest one, squared: over that distance shapes change
/// smoothly, and every image has many neighbors.
double squared_length_of(const MatrixXd& images) {
  const Index nearest = std::min<Index>(24, images.rows() - 1);
  const auto count = static_cast<std::size_t>(images.rows());
  std::vector<double> found;
  for (const std::size_t i : spread_samples(std::min<std::size_t>(256, count), count)) {
    const Eigen::VectorXd distances = (images.rowwise() - images.row(static_cast<Index>(i))).rowwise().squaredNorm();
    std::vector<double> sorted(distances.begin(), distances.end());
    std::ranges::nth_element(sorted, sorted.begin() + nearest);
    found.push_back(sorted[static_cast<std::size_t>(nearest)]);
  }
  const auto middle = found.begin() + std::ssize(found) / 2;
  std::ranges::nth_element(found, middle);
  return *middle > 0 ? 36 * *middle : 1;
}

/// Row by row, rows padded with zeros.
std::vector<float> padded_rows(const MatrixXd& matrix, std::size_t stride) {
  std::vector<float> rows(static_cast<std::size_t>(matrix.rows()) * stride, 0.0f);
  for (Index i = 0; i < matrix.rows(); ++i)
    for (Index j = 0; j < matrix.cols(); ++j)
      rows[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(j)] = static_cast<float>(matrix(i, j));
  return rows;
}

}  // namespace

TrainedShapes TrainedShapes::untrained(const DepthCamera& camera, std::size_t samples) {
  constexpr std::size_t k = ShapeRegression::image_scores, scores = ShapeRegression::shape_scores;
  const std::size_t images = ShapeRegression::trained_with(samples);
  const auto zeros = [](std::size_t count) { return std::vector<float>(count, 0.0f); };
  return {zeros((2 + k) * ShapeRegression::features(camera)), zeros(images * k), zeros(scores * format::padded(images)),
          zeros(samples * scores)};
}

ShapeTraining::ShapeTraining(const SampleSource& source, const DepthMetric& metric)
    : samples_(source.samples),
      trained_(spread_samples(ShapeRegression::trained_with(samples_.size()), samples_.size())),
      windows_(source.camera),
      typical_(windows_.count(), 0.0f),
      features_(ShapeRegression::features(source.camera)),
      one_sided_(metric.one_sided / source.camera.depth_step) {
  read_images(source, metric.mesh_noise / source.camera.depth_step);
  read_shapes(source);
}

RowVectorXd ShapeTraining::features(std::span<const float> observed) {
  windows_.build(observed);
  windows_.write_features(typical_, one_sided_, features_);
  return Eigen::Map<const Eigen::RowVectorXf>(features_.data(), std::ssize(features_)).cast<double>();
}

/// Of every two training images one is disturbed, so that the regression does not depend on what sensors change.
void ShapeTraining::read_images(const SampleSource& source, float noise) {
  const auto is_disturbed = [](std::size_t i) { return (i ^ splitmix(i / 2)) % 2 == 1; };
  const auto image_of = [&](std::size_t i) {
    std::vector<float> observed = observed_image(source, trained_[i]);
    if (is_disturbed(i)) disturb(source.camera, noise, i, observed);
    return observed;
  };
  std::vector<double> depths(typical_.size(), 0.0), shares(typical_.size(), 0.0);
  for (std::size_t i = 0; i < trained_.size(); ++i) {
    if (is_disturbed(i)) continue;
    windows_.build(image_of(i));
    for (std::size_t w = 0; w < typical_.size(); ++w) {
      shares[w] += double{windows_.shares()[w]};
      depths[w] += double{windows_.shares()[w]} * double{windows_.depths()[w]};
    }
  }
  const double all =
      std::reduce(depths.begin(), depths.end()) / std::max(std::reduce(shares.begin(), shares.end()), 1.0);
  for (std::size_t w = 0; w < typical_.size(); ++w)
    typical_[w] = static_cast<float>(shares[w] > 0 ? depths[w] / shares[w] : all);

  MatrixXd rows(std::ssize(trained_), std::ssize(features_));
  for (std::size_t i = 0; i < trained_.size(); ++i) rows.row(static_cast<Index>(i)) = features(image_of(i));
  mean_ = rows.colwise().mean();
  rows.rowwise() -= mean_;
  components_ = principal_components(rows(snapshots_of(trained_.size()), Eigen::all), ShapeRegression::image_scores);
  images_ = rows * components_;
  squared_length_ = squared_length_of(images_);
}

void ShapeTraining::read_shapes(const SampleSource& source) {
  std::vector<float> positions(3 * source.nodes);
  const auto shape_of = [&](std::size_t sample) -> RowVectorXd {
    source.read_positions(sample, positions);
    const std::vector<float> nodes = thinned_nodes(positions, compared_nodes);
    const auto row = Eigen::Map<const Eigen::RowVectorXf>(nodes.data(), std::ssize(nodes)).cast<double>();
    return row / std::sqrt(static_cast<double>(row.cols()) / 3);  // distances are root mean squares over nodes
  };
  const std::vector<std::size_t> chosen = snapshots_of(samples_.size());
  MatrixXd snapshots(std::ssize(chosen), shape_of(0).cols());
  for (std::size_t i = 0; i < chosen.size(); ++i) snapshots.row(static_cast<Index>(i)) = shape_of(chosen[i]);
  const RowVectorXd mean = snapshots.colwise().mean();
  snapshots.rowwise() -= mean;
  const MatrixXd components = principal_components(snapshots, ShapeRegression::shape_scores);
  shapes_.resize(std::ssize(samples_), components.cols());
  for (std::size_t s = 0; s < samples_.size(); ++s)
    shapes_.row(static_cast<Index>(s)) = (shape_of(s) - mean) * components;
}

MatrixXd ShapeTraining::kernel(const MatrixXd& a, const MatrixXd& b) const {
  MatrixXd squared = -2 * a * b.transpose();
  squared.colwise() += a.rowwise().squaredNorm();
  squared.rowwise() += b.rowwise().squaredNorm().transpose();
  return squared.unaryExpr([this](double d) { return inverse_multiquadric(d, squared_length_); });
}

MatrixXd ShapeTraining::trained_shapes() const {
  MatrixXd shapes(images_.rows(), shapes_.cols());
  for (Index i = 0; i < shapes.rows(); ++i)
    shapes.row(i) = shapes_.row(static_cast<Index>(trained_[static_cast<std::size_t>(i)]));
  return shapes;
}

MatrixXd ShapeTraining::predict_left_out(const LeftOutFrames& frames, const Workers& workers,
                                         std::span<const CompletedFrame> completed) {
  MatrixXd images(static_cast<Index>(frames.size() + completed.size()), std::ssize(features_));
  std::vector<std::size_t> samples;
  const auto add = [&](std::size_t sample, std::span<const float> image) {
    images.row(std::ssize(samples)) = features(image) - mean_;
    samples.push_back(sample);
  };
  for (std::size_t f = 0; f < frames.size(); ++f) add(frames.sample(f), frames.observed(f));
  for (const auto& [sample, image] : completed) add(sample, image);
  const MatrixXd kernels = kernel(images_, images * components_);
  const MatrixXd matrix = kernel(images_, images_);
  std::array<Regression, regularizations.size()> regressions;
  work_in_parallel(regressions.size(), workers, [&](const auto& next) {
    for (std::size_t i = next(); i < regressions.size(); i = next()) {
      MatrixXd regularized = matrix;
      regularized.diagonal().array() += regularizations[i];
      regressions[i] = regress(samples, regularized, kernels);
    }
  });
  const auto error = [&](const Regression& regression) {
    double sum = 0;
    for (std::size_t f = 0; f < frames.size(); ++f)
      sum +=
          (regression.left_out.row(static_cast<Index>(f)) - shapes_.row(static_cast<Index>(frames.sample(f)))).norm();
    return sum;
  };
  Regression& best = *std::ranges::min_element(regressions, {}, error);
  weights_ = std::move(best.weights);
  return std::move(best.left_out);
}

/// matrix: K + regularization I. With A its inverse, weights w = A Y and the images g of a simulation, the regression
/// without these predicts k'w - (A k)_g' A_gg^-1 w_g: block-wise inversion.
ShapeTraining::Regression ShapeTraining::regress(std::span<const std::size_t> samples, const MatrixXd& matrix,
                                                 const MatrixXd& kernels) const {
  const MatrixXd inverse = inverse_of_symmetric(matrix), weights = inverse * trained_shapes();
  MatrixXd predicted = kernels.transpose() * weights;
  const auto simulation = [&](std::size_t frame) { return samples_[samples[frame]].simulation; };
  for (std::size_t f = 0, end = 0; f < samples.size(); f = end) {
    while (end < samples.size() && simulation(end) == simulation(f)) ++end;
    const auto [first, count] = images_of(simulation(f));
    if (count == 0) continue;
    const auto frames = static_cast<Index>(f), number = static_cast<Index>(end - f);
    const MatrixXd solved = inverse.middleCols(first, count).transpose() * kernels.middleCols(frames, number);
    predicted.middleRows(frames, number) -=
        solved.transpose() * inverse.block(first, first, count, count).llt().solve(weights.middleRows(first, count));
  }
  return {weights, predicted};
}

/// Its first training image, and their number.
std::pair<Index, Index> ShapeTraining::images_of(std::uint32_t simulation) const {
  const auto simulation_of = [this](std::size_t sample) { return samples_[sample].simulation; };
  const auto first = std::ranges::lower_bound(trained_, simulation, {}, simulation_of);
  const auto end = std::ranges::upper_bound(first, trained_.end(), simulation, {}, simulation_of);
  return {first - trained_.begin(), end - first};
}

TrainedShapes ShapeTraining::train() const {
  TrainedShapes trained;
  const std::size_t features = features_.size();
  trained.basis.assign(features, 0.0f);
  std::ranges::copy(typical_, trained.basis.begin());
  MatrixXd basis(1 + components_.cols(), components_.rows());
  basis << mean_, components_.transpose();
  const std::vector<float> rows = padded_rows(basis, features);
  trained.basis.insert(trained.basis.end(), rows.begin(), rows.end());
  trained.images = padded_rows(images_, ShapeRegression::image_scores);
  trained.weights = padded_rows(weights_.transpose(), format::padded(trained_.size()));
  trained.shapes = padded_rows(shapes_, ShapeRegression::shape_scores);
  trained.one_sided = one_sided_;
  trained.length_scale = static_cast<float>(std::sqrt(squared_length_));
  return trained;
}

}  // namespace lbea::bake
