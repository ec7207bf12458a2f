// Predicts a frame's shape from its whole depth image: kernel ridge regression on principal components, trained by the
// bake. Parts that something may hide are completed from the combination of candidates before.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

namespace lbea {

/// Kernel of the regression, the inverse multiquadric (Hardy 1971): 1 / sqrt(1 + d^2 / length^2).
template <typename Real>
[[nodiscard]] Real inverse_multiquadric(Real squared_distance, Real squared_length) noexcept {
  return 1 / std::sqrt(1 + std::max(squared_distance, Real{0}) / squared_length);
}

/// Sixteen sums, so that no addition waits for the previous one.
[[nodiscard]] inline float squared_distance(std::span<const float> a, std::span<const float> b) noexcept {
  constexpr std::size_t lanes = 16;
  std::array<float, lanes> sums{};
  const std::size_t rest = a.size() % lanes, whole = a.size() - rest;
  for (std::size_t i = 0; i < whole; i += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane) sums[lane] += square(a[i + lane] - b[i + lane]);
  for (std::size_t lane = 0; lane < rest; ++lane) sums[lane] += square(a[whole + lane] - b[whole + lane]);
  for (std::size_t half = lanes / 2; half > 0; half /= 2)
    for (std::size_t lane = 0; lane < half; ++lane) sums[lane] += sums[lane + half];
  return sums[0];
}

/// What the regression sees of a depth image: windows of 4 x 4 cells at every second row and column. Their means
/// change little when single cells are empty or edges are cut off.
class ImageWindows {
 public:
  /// Allocates all memory.
  explicit ImageWindows(const DepthCamera& camera);
  [[nodiscard]] std::size_t count() const noexcept { return down_ * across_; }
  /// Per window: the mean depth of its filled cells, in steps, or 0; and their share of its 16 cells. observed:
  /// padded_cells() values. Does not allocate.
  void build(std::span<const float> observed) noexcept;
  [[nodiscard]] std::span<const float> depths() const noexcept { return depths_; }
  [[nodiscard]] std::span<const float> shares() const noexcept { return shares_; }
  /// Features of the regression, ShapeRegression::features() values: per window (depth - typical) share, then
  /// (1 - share) one_sided, in depth steps.
  void write_features(std::span<const float> typical, float one_sided, std::span<float> features) const noexcept;

 private:
  std::size_t columns_, rows_, across_, down_;
  std::vector<float> row_depths_, row_counts_;  // rows x across: sums over four columns
  std::vector<float> depths_, shares_;
};

/// Rows of numbers, to be multiplied with vectors, in half the memory: 16 bits each, in 2^-15 of the greatest of their
/// column. Columns of zeros are left out: cells that no sample fills have no principal components.
class ShortRows {
 public:
  /// rows: whole rows of `columns` floats. Allocates all memory.
  ShortRows(std::span<const float> rows, std::size_t columns);
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  /// Products with each row. vector: as many as columns. Does not allocate.
  void multiply(const Kernels& code, std::span<const float> vector, std::span<float> products) noexcept;
  /// Of each row.
  [[nodiscard]] std::vector<float> squared_norms() const;

 private:
  struct Column {
    std::uint32_t place;
    float unit;
  };
  std::size_t count_, stride_;
  std::vector<Column> columns_;  // that are not zeros
  std::vector<std::uint16_t> numbers_;
  std::vector<float> scaled_;  // the vector, in these columns' units; then zeros
};

class ShapePredictor {
 public:
  /// Allocates all memory. Keeps spans of the images' regression.
  explicit ShapePredictor(const DepthImages& images);
  /// Principal components of the shape, ShapeRegression::shape_scores values, valid until the next call; nothing if the
  /// bake has not trained a regression. observed: padded_cells() values of an image of which nothing is hidden, or that
  /// is completed. Does
  /// not allocate.
  [[nodiscard]] std::span<const float> predict(std::span<const float> observed) noexcept;

 private:
  const Kernels& code_;
  ShapeRegression regression_;
  ImageWindows windows_;
  ShortRows components_, images_;
  std::vector<float> features_, image_, squared_norms_, kernel_, shape_;
};

/// A frame's depth image with the parts that something may hide taken from the combination of candidates.
class CompletedImage {
 public:
  /// Allocates all memory.
  explicit CompletedImage(const DepthCamera& camera);
  void clear() noexcept;
  /// A candidate and its share in the combination. residuals: its own; hidden_price: those in its hidden parts.
  void add(float share, std::span<const std::uint16_t> image, std::span<const float> residuals,
           float hidden_price) noexcept;
  /// observed: limited to its Surroundings. Cells that are not observed, or hidden parts of most of the combination,
  /// get the combination's depth, if most of it fills them.
  void finish(std::span<const float> observed) noexcept;
  /// padded_cells() depths in steps.
  [[nodiscard]] std::span<const float> cells() const noexcept { return cells_; }

 private:
  std::vector<float> cells_, filled_, hidden_;  // sums of depths and of shares
};

}  // namespace lbea
