#include "runtime/src/depth/shape_regression.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace lbea {

namespace {
constexpr std::size_t interval = 2, reach_before = 1, reach_after = 2;  // cells: the windows' distance and reach

ShortRows components_of(const DepthImages& images) {
  const ShapeRegression& regression = images.regression;
  const std::size_t features = ShapeRegression::features(images.camera);
  return {regression.basis.empty() ? std::span<const float>{} : regression.components(features), features};
}

}  // namespace

ImageWindows::ImageWindows(const DepthCamera& camera)
    : columns_(camera.columns),
      rows_(camera.rows),
      across_((columns_ + interval - 1) / interval),
      down_((rows_ + interval - 1) / interval),
      row_depths_(rows_ * across_),
      row_counts_(rows_ * across_),
      depths_(down_ * across_),
      shares_(down_ * across_) {}

void ImageWindows::build(std::span<const float> observed) noexcept {
  const auto begin = [](std::size_t i) { return interval * i - std::min(interval * i, reach_before); };
  for (std::size_t row = 0; row < rows_; ++row)
    for (std::size_t i = 0; i < across_; ++i) {
      float depth = 0, count = 0;
      for (std::size_t column = begin(i); column < std::min(interval * i + reach_after + 1, columns_); ++column) {
        const float cell = observed[row * columns_ + column];
        depth += cell >= 0 ? cell : 0.0f;
        count += cell >= 0 ? 1.0f : 0.0f;
      }
      row_depths_[row * across_ + i] = depth;
      row_counts_[row * across_ + i] = count;
    }
  constexpr auto cells = static_cast<float>((reach_before + reach_after + 1) * (reach_before + reach_after + 1));
  for (std::size_t j = 0; j < down_; ++j)
    for (std::size_t i = 0; i < across_; ++i) {
      float depth = 0, count = 0;
      for (std::size_t row = begin(j); row < std::min(interval * j + reach_after + 1, rows_); ++row) {
        depth += row_depths_[row * across_ + i];
        count += row_counts_[row * across_ + i];
      }
      depths_[j * across_ + i] = count > 0 ? depth / count : 0;
      shares_[j * across_ + i] = count / cells;
    }
}

void ImageWindows::write_features(std::span<const float> typical, float one_sided,
                                  std::span<float> features) const noexcept {
  const std::size_t n = count();
  for (std::size_t i = 0; i < n; ++i) {
    features[i] = (depths_[i] - typical[i]) * shares_[i];
    features[n + i] = (1 - shares_[i]) * one_sided;
  }
}

[[gnu::cold]]  // compiled for size
ShortRows::ShortRows(std::span<const float> rows, std::size_t columns)
    : count_(rows.size() / columns) {
  constexpr float most = 32'767, zero = 32'768;
  for (std::uint32_t place = 0; place < columns; ++place) {
    float greatest = 0;
    for (std::size_t i = place; i < rows.size(); i += columns) greatest = std::max(greatest, std::abs(rows[i]));
    if (const float unit = greatest / most; unit >= std::numeric_limits<float>::min())
      columns_.push_back({place, unit});
  }
  stride_ = format::padded(columns_.size());
  scaled_.resize(stride_);
  numbers_ = std::vector(count_ * stride_, static_cast<std::uint16_t>(zero));
  for (std::size_t row = 0; row < count_; ++row)
    for (std::size_t i = 0; i < columns_.size(); ++i)
      numbers_[row * stride_ + i] =
          static_cast<std::uint16_t>(zero + std::round(rows[row * columns + columns_[i].place] / columns_[i].unit));
}

void ShortRows::multiply(const Kernels& code, std::span<const float> vector, std::span<float> products) noexcept {
  std::ranges::transform(columns_, scaled_.begin(), [&](const Column& one) { return vector[one.place] * one.unit; });
  code.project_short(numbers_.data(), count_, stride_, scaled_.data(), products.data());
}

[[gnu::cold]] std::vector<float> ShortRows::squared_norms() const {
  std::vector<float> norms(count_);
  for (std::size_t row = 0; row < count_; ++row)
    for (std::size_t i = 0; i < columns_.size(); ++i)
      norms[row] += square((static_cast<float>(numbers_[row * stride_ + i]) - 32'768) * columns_[i].unit);
  return norms;
}

[[gnu::cold]]  // compiled for size
ShapePredictor::ShapePredictor(const DepthImages& images)
    : code_(kernels()),
      regression_(images.regression),
      windows_(images.camera),
      components_(components_of(images)),
      images_(regression_.images, ShapeRegression::image_scores),
      features_(ShapeRegression::features(images.camera)),
      image_(ShapeRegression::image_scores),
      squared_norms_(images_.squared_norms()),
      kernel_(regression_.weights.size() / ShapeRegression::shape_scores),
      shape_(ShapeRegression::shape_scores) {}

std::span<const float> ShapePredictor::predict(std::span<const float> observed) noexcept {
  if (regression_.blend == 0) return {};
  const std::size_t features = features_.size();
  windows_.build(observed);
  windows_.write_features(regression_.typical(features), regression_.one_sided, features_);
  const auto mean = regression_.mean(features);
  for (std::size_t i = 0; i < features; ++i) features_[i] -= mean[i];
  components_.multiply(code_, features_, image_);
  images_.multiply(code_, image_, kernel_);
  const float squared = std::inner_product(image_.begin(), image_.end(), image_.begin(), 0.0f),
              squared_length = square(regression_.length_scale);
  for (std::size_t i = 0; i < squared_norms_.size(); ++i)
    kernel_[i] = inverse_multiquadric(squared + squared_norms_[i] - 2 * kernel_[i], squared_length);
  code_.project(regression_.weights.data(), shape_.size(), kernel_.size(), kernel_.data(), shape_.data());
  return shape_;
}

CompletedImage::CompletedImage(const DepthCamera& camera)
    : cells_(padded_cells(camera)), filled_(cells_.size()), hidden_(cells_.size()) {}

void CompletedImage::clear() noexcept {
  for (std::vector<float>* sums : {&cells_, &filled_, &hidden_}) std::ranges::fill(*sums, 0.0f);
}

void CompletedImage::add(float share, std::span<const std::uint16_t> image, std::span<const float> residuals,
                         float hidden_price) noexcept {
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    cells_[c] += share * static_cast<float>(image[c]);
    filled_[c] += image[c] != empty_cell ? share : 0.0f;
    hidden_[c] += residuals[c] == hidden_price ? share : 0.0f;
  }
}

void CompletedImage::finish(std::span<const float> observed) noexcept {
  constexpr float most = 0.5f;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const bool is_hidden = observed[c] == not_observed || (observed[c] == nothing_seen && hidden_[c] > most);
    if (is_hidden && filled_[c] > most)
      cells_[c] /= filled_[c];
    else
      cells_[c] = observed[c] >= 0 ? observed[c] : nothing_seen;
  }
}

}  // namespace lbea
