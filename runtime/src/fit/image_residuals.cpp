#include "runtime/src/fit/image_residuals.hpp"

#include <bit>

namespace lbea {
namespace {

constexpr std::size_t cells_of_line = 32;  // with whole pairs of lanes, products are the same as with all cells

}  // namespace

[[gnu::cold]]  // compiled for size
ImageResiduals::ImageResiduals(const DepthImages& images, CandidateSearch& search, std::size_t most)
    : images_(images),
      search_(search),
      code_(kernels()),
      states_(most),
      residuals_(most * padded_cells(images.camera)),
      of_next_(padded_cells(images.camera)),
      gathered_(residuals_.size()),
      products_(most),
      predictor_(images),
      completed_(images.camera) {
  lines_.reserve(padded_cells(images.camera));
}

void ImageResiduals::compare(std::span<const RankedSample> samples) noexcept {
  count_ = samples.size();
  prices_hidden_ = true;
  std::ranges::transform(samples, states_.begin(), [](const RankedSample& one) { return StateBetween{one.sample}; });
  compare_states();
}

void ImageResiduals::compare(std::span<const StateBetween> states, bool prices_hidden) noexcept {
  count_ = states.size();
  prices_hidden_ = prices_hidden;
  std::ranges::copy(states, states_.begin());
  compare_states();
}

// The residual of a combination is approximated by the combination of the residuals. That is exact along a line of
// sight that meets the same surface in all samples. A cell that only some samples fill counts with their share.
void ImageResiduals::compare_states() noexcept {
  const FrameImage& frame = search_.image();
  const auto image = images_.of_sample(states_[0].sample);
  filled_ = code_.compare_depths(frame.observed.data(), image.data(), image.size(), search_.ranking().prices()).filled;
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& [sample, next, share] = states_[i];
    const float hidden = subtract(sample, of(i));
    if (i == 0) filled_ -= hidden;
    if (share == 0) continue;
    (void)subtract(next, of_next_);
    for (std::size_t c = 0; c < of_next_.size(); ++c) of(i)[c] += share * (of_next_[c] - of(i)[c]);
  }
  filled_ = std::max(filled_, 1.0f);
  gather();
}

/// Returns the number of cells that something may hide.
float ImageResiduals::subtract(std::uint32_t sample, std::span<float> residuals) noexcept {
  const FrameImage& frame = search_.image();
  const auto image = images_.of_sample(sample);
  DepthRanking& ranking = search_.ranking();
  code_.subtract_depths(frame.observed.data(), image.data(), residuals.size(), ranking.prices(), residuals.data());
  return frame.is_hidden ? ranking.price_hidden(frame.observed, image, residuals, prices_hidden_) : 0;
}

/// Copies the residuals without the lines of cells at which all are zero.
void ImageResiduals::gather() noexcept {
  const std::size_t cells = padded_cells(images_.camera);
  lines_.clear();
  for (std::size_t begin = 0; begin < cells; begin += cells_of_line) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t c = begin; c < begin + cells_of_line; ++c)
        bits |= std::bit_cast<std::uint32_t>(residuals_[i * cells + c]);
    if (bits << 1 != 0) lines_.push_back(static_cast<std::uint32_t>(begin));  // but for the sign of zeros
  }
  const std::size_t stride = cells_of_line * lines_.size();
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t l = 0; l < lines_.size(); ++l)
      std::copy_n(&residuals_[i * cells + lines_[l]], cells_of_line, &gathered_[i * stride + cells_of_line * l]);
}

void ImageResiduals::add_products(float scale, std::span<float> gram) noexcept {
  const std::size_t stride = cells_of_line * lines_.size();
  lbea::add_products(code_, gathered_.data(), count_, stride, scale, products_, gram);
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = 0; j < i; ++j) gram[i * count_ + j] = gram[j * count_ + i];
}

void ImageResiduals::complete(std::span<const float> shares) noexcept {
  const float hidden = prices_hidden_ ? search_.ranking().hidden_price() : 0;
  completed_.clear();
  for (std::size_t i = 0; i < count_; ++i)
    if (shares[i] != 0) completed_.add(shares[i], images_.of_sample(states_[i].sample), of(i), hidden);
  completed_.finish(search_.image().observed);
}

std::span<const float> ImageResiduals::predict_completed(std::span<const float> shares) noexcept {
  complete(shares);
  if (images_.regression.hidden_blend == 0) return {};
  return predictor_.predict(completed_.cells());
}

}  // namespace lbea
