#include "runtime/src/depth/shape_regression.hpp"

#include <algorithm>
#include <numeric>

namespace lbea {

namespace {
constexpr std::size_t interval = 2, reach_before = 1, reach_after = 2;  // cells: the windows' distance and reach
}

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
ShapePredictor::ShapePredictor(const DepthImages& images)
    : code_(kernels()),
      regression_(images.regression),
      windows_(images.camera),
      features_(ShapeRegression::features(images.camera)),
      image_(ShapeRegression::image_scores),
      kernel_(regression_.weights.size() / ShapeRegression::shape_scores),
      shape_(ShapeRegression::shape_scores) {
  constexpr std::size_t k = ShapeRegression::image_scores;
  for (std::size_t i = 0; i < regression_.images.size(); i += k) {
    const auto image = regression_.images.subspan(i, k);
    squared_norms_.push_back(std::inner_product(image.begin(), image.end(), image.begin(), 0.0f));
  }
}

std::span<const float> ShapePredictor::predict(std::span<const float> observed) noexcept {
  if (regression_.blend == 0) return {};
  constexpr std::size_t k = ShapeRegression::image_scores;
  const std::size_t features = features_.size(), images = squared_norms_.size();
  windows_.build(observed);
  windows_.write_features(regression_.typical(features), regression_.one_sided, features_);
  const auto mean = regression_.mean(features);
  for (std::size_t i = 0; i < features; ++i) features_[i] -= mean[i];
  code_.project(regression_.components(features).data(), k, features, features_.data(), image_.data());
  code_.project(regression_.images.data(), images, k, image_.data(), kernel_.data());
  const float squared = std::inner_product(image_.begin(), image_.end(), image_.begin(), 0.0f),
              squared_length = square(regression_.length_scale);
  for (std::size_t i = 0; i < images; ++i)
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
