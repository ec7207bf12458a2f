#include "runtime/src/depth/depth_ranking.hpp"

namespace lbea {
DepthRanking::DepthRanking(const DepthCamera& camera, std::uint32_t capacity, const DepthMetric& metric,
                           std::uint32_t most_proposed, float sharpness)
    : code_(kernels()),
      prices_(prices_of(metric, camera)),
      hidden_price_(metric.hidden / camera.depth_step),
      noise_(square(metric.mesh_noise / camera.depth_step)),
      sharpness_(sharpness),
      compared_(most_proposed),
      best_(capacity),
      chosen_(capacity),
      common_(padded_cells(camera)),
      promising_(most_promising),
      whole_(padded_cells(camera)),
      parts_(camera) {}

float DepthRanking::rank(std::span<float> observed, std::span<const std::uint16_t> depths,
                         std::span<const RankedSample> proposed, const ExpectationCosts* costs) noexcept {
  compare(observed, depths, proposed);
  choose(best_, nullptr);
  const float least = ranked()[0].distance;
  find_common(depths);
  for (std::size_t c = 0; c < common_.size(); ++c)
    if (common_[c] != 0 && observed[c] == nothing_seen) observed[c] = not_observed;
  const auto chosen = std::span(chosen_).first(ranked().size());
  std::ranges::copy(ranked(), chosen.begin());
  compare(observed, depths, chosen);
  choose(best_, costs);
  return least;
}

float DepthRanking::rank_hidden(std::span<const float> observed, std::span<const std::uint16_t> depths,
                                std::span<const RankedSample> proposed, const ExpectationCosts* costs) noexcept {
  const std::size_t stride = observed.size();
  std::ranges::transform(observed, whole_.begin(), [](float depth) { return depth < 0 ? nothing_seen : depth; });
  parts_.set_frame(whole_);
  compare(observed, depths, proposed);
  choose(promising_, costs);
  compared_count_ = 0;
  for (const RankedSample& one : promising_.ranked()) {
    const auto image = depths.subspan(one.sample * stride, stride);
    const CellSums sums = code_.compare_depths(whole_.data(), image.data(), stride, prices_);
    const auto hidden = static_cast<float>(parts_.find(image));
    const float price = square(hidden_price_) * hidden, others = std::max(sums.filled - hidden, 1.0f);
    const float mean = std::max(sums.squares - square(prices_.one_sided) * hidden, 0.0f) / others + price / others;
    compared_[compared_count_++] = {one.sample, mean};
  }
  choose(best_, costs);
  find_common(depths);
  return ranked()[0].distance - residual_beside_hidden(observed, depths.subspan(ranked()[0].sample * stride, stride));
}

/// Mean square over what the frame shows and its surroundings, but for what the sample or all of the best ones
/// continue.
float DepthRanking::residual_beside_hidden(std::span<const float> observed,
                                           std::span<const std::uint16_t> image) noexcept {
  for (std::size_t c = 0; c < observed.size(); ++c)
    whole_[c] = common_[c] != 0 && observed[c] == nothing_seen ? not_observed : observed[c];
  parts_.find(image);
  parts_.visit([this](std::size_t cell) { whole_[cell] = not_observed; });
  return mean_square(code_, whole_, image.data(), prices_);
}

float DepthRanking::price_hidden(std::span<const float> observed, std::span<const std::uint16_t> image,
                                 std::span<float> residuals) noexcept {
  float count = 0;
  parts_.find(image);
  parts_.visit([&](std::size_t cell) {
    if (observed[cell] != nothing_seen) return;
    residuals[cell] = hidden_price_;
    ++count;
  });
  return count;
}

void DepthRanking::compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
                           std::span<const RankedSample> proposed) noexcept {
  compared_count_ = std::min(proposed.size(), compared_.size());
  for (std::size_t i = 0; i < compared_count_; ++i) {
    const std::uint32_t sample = proposed[i].sample;
    compared_[i] = {sample, mean_square(code_, observed, &depths[sample * observed.size()], prices_)};
  }
}

/// The cost of a sample, the negative logarithm of a probability, has the price of as much less Plausibility.
void DepthRanking::choose(BestSamples& best, const ExpectationCosts* costs) noexcept {
  const auto compared = std::span(compared_).first(compared_count_);
  float least = std::numeric_limits<float>::infinity();
  for (const RankedSample& one : compared) least = std::min(least, one.distance);
  price_per_cost_ = (least + noise_) / sharpness_;
  best.clear();
  for (const RankedSample& one : compared)
    best.offer(one.sample, one.distance + (costs != nullptr ? price_per_cost_ * (*costs)[one.sample] : 0.0f));
}

void DepthRanking::find_common(std::span<const std::uint16_t> depths) noexcept {
  std::ranges::fill(common_, std::uint16_t{1});
  for (const RankedSample& best : ranked()) {
    const std::uint16_t* image = &depths[best.sample * common_.size()];
    for (std::size_t c = 0; c < common_.size(); ++c)
      common_[c] = static_cast<std::uint16_t>(common_[c] & (image[c] != empty_cell));
  }
}

}  // namespace lbea
