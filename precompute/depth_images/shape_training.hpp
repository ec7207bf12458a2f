// Trains the regression from depth images to shapes: kernel ridge regression on images of the samples.
#pragma once

#include "precompute/left_out/left_out_frames.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/depth/shape_regression.hpp"

#include <Eigen/Cholesky>

namespace lbea::bake {

/// Owns the memory of a ShapeRegression's spans.
struct TrainedShapes {
  std::vector<float> basis, images, weights, shapes;
  float one_sided = 0, length_scale = 0, blend = 0, most_difference = 0;  // as in ShapeRegression
  float hidden_blend = 0, hidden_most_difference = 0;

  [[nodiscard]] ShapeRegression view() const noexcept {
    return {basis,        images, weights,         shapes,       one_sided,
            length_scale, blend,  most_difference, hidden_blend, hidden_most_difference};
  }
  /// Zeros, for an ensemble that allows no training.
  [[nodiscard]] static TrainedShapes untrained(const DepthCamera& camera, std::size_t samples);
};

/// See CompletedImage.
struct CompletedFrame {
  std::size_t sample;
  std::span<const float> image;
};

class ShapeTraining {
 public:
  /// Reads images and positions of the samples. metric: its one-sided cost is the feature of empty windows, its mesh
  /// noise the standard deviation of the disturbed images' offsets.
  ShapeTraining(const SampleSource& source, const DepthMetric& metric);

  /// Shape scores of the frames, one row each, each by a regression without the frame's simulation. Keeps the
  /// regularization with the least mean error. Then the same for the completed images, with this regularization. Takes
  /// 100 MB per thread.
  [[nodiscard]] Eigen::MatrixXd predict_left_out(const LeftOutFrames& frames, const Workers& workers,
                                                 std::span<const CompletedFrame> completed = {});
  /// Shape scores of all samples, one row each.
  [[nodiscard]] const Eigen::MatrixXd& shapes() const noexcept { return shapes_; }
  /// The regression from all simulations, blend and greatest difference still 0. Call predict_left_out() before.
  [[nodiscard]] TrainedShapes train() const;

 private:
  void read_images(const SampleSource& source, float noise);
  void read_shapes(const SampleSource& source);
  [[nodiscard]] Eigen::RowVectorXd features(std::span<const float> observed);
  [[nodiscard]] Eigen::MatrixXd kernel(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const;
  struct Regression {
    Eigen::MatrixXd weights;   // t x shape_scores
    Eigen::MatrixXd left_out;  // frames x shape_scores: predictions without the frame's simulation
  };
  [[nodiscard]] Regression regress(std::span<const std::size_t> samples, const Eigen::MatrixXd& matrix,
                                   const Eigen::MatrixXd& kernels) const;
  [[nodiscard]] std::pair<Eigen::Index, Eigen::Index> images_of(std::uint32_t simulation) const;
  [[nodiscard]] Eigen::MatrixXd trained_shapes() const;

  std::vector<Sample> samples_;
  std::vector<std::size_t> trained_;  // per training image: its sample
  ImageWindows windows_;
  std::vector<float> typical_, features_;
  float one_sided_;             // depth steps
  Eigen::RowVectorXd mean_;     // of the features
  Eigen::MatrixXd components_;  // features x image_scores
  Eigen::MatrixXd images_;      // t x image_scores
  Eigen::MatrixXd shapes_;      // s x shape_scores
  Eigen::MatrixXd weights_;     // t x shape_scores
  double squared_length_ = 1;
};

}  // namespace lbea::bake
