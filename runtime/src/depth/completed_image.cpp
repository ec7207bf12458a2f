#include "runtime/src/depth/completed_image.hpp"

#include <algorithm>

namespace lbea {

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
