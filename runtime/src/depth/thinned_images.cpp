#include "runtime/src/depth/thinned_images.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

namespace lbea {

[[gnu::cold]] std::vector<std::uint32_t> thinned_cells(const DepthImages& images) {
  constexpr std::uint32_t every = 4;
  const std::size_t stride = padded_cells(images.camera);
  std::vector<std::uint16_t> filled(stride);
  for (std::size_t s = 0; s < images.depths.size() / stride; ++s)
    std::ranges::transform(images.of_sample(s), filled, filled.begin(), std::bit_or<>());
  std::vector<std::uint32_t> cells;
  for (std::uint32_t row = every / 2; row < images.camera.rows; row += every)
    for (std::uint32_t column = every / 2; column < images.camera.columns; column += every)
      if (const std::uint32_t cell = row * images.camera.columns + column; filled[cell] != 0) cells.push_back(cell);
  return cells;
}

[[gnu::cold]]  // compiled for size
ThinnedImages::ThinnedImages(const DepthImages& images)
    : code_(kernels()),
      cells_(thinned_cells(images)),
      order_(images.depths.size() / padded_cells(images.camera)),
      observed_(padded_cells(cells_.size()), not_observed),
      lines_(observed_.size(), prices_of(images.metric, images.camera)),
      nearest_(opened) {
  std::iota(order_.begin(), order_.end(), 0u);
  compared_ = order_;
  if (cells_.empty()) return;
  copy_cells(images);
  if (order_.size() <= most_compared) return;
  sort_by_similarity(order_);
  std::vector<std::uint32_t> parts = compared_;
  copy_cells(images);
  while (parts.size() > most_compared) {
    const std::vector<std::uint32_t> below = std::exchange(parts, {});
    for (std::size_t first = 0; first < below.size(); first += block)
      parts.push_back(
          middle_of(std::span(below).subspan(first).first(std::min<std::size_t>(block, below.size() - first))));
    representatives_.push_back(parts);
  }
  compared_ = std::vector<std::uint32_t>(std::max<std::size_t>(parts.size(), opened * block));
}

/// Of the sample at each place.
[[gnu::cold]] void ThinnedImages::copy_cells(const DepthImages& images) {
  depths_ = std::vector(order_.size() * observed_.size(), empty_cell);
  for (std::size_t place = 0; place < order_.size(); ++place)
    std::ranges::transform(cells_, &depths_[place * observed_.size()],
                           [image = images.of_sample(order_[place])](auto cell) { return image[cell]; });
}

/// So that each block of consecutive ones is similar: of two that differ much, one half is more similar to the first.
/// The samples are at their own places.
[[gnu::cold]] void ThinnedImages::sort_by_similarity(std::span<std::uint32_t> samples) {
  if (samples.size() <= block) return;
  const std::uint32_t second = farthest_from(samples.front(), samples), first = farthest_from(second, samples);
  std::vector<RankedSample> compared;  // distance: from the first minus that from the second
  for (const std::uint32_t sample : samples) compared.push_back({sample, 0});
  for (const float sign : {1.0f, -1.0f}) {
    set_frame_of(sign > 0 ? first : second);
    for (RankedSample& one : compared) one.distance += sign * distance(one.sample);
  }
  std::size_t whole = block;  // samples in the largest blocks of blocks, which are not divided here
  while (whole * block < samples.size()) whole *= block;
  const std::size_t half = (samples.size() / 2 + whole - 1) / whole * whole;
  put_nearest_first(compared, half);
  std::ranges::transform(compared, samples.begin(), &RankedSample::sample);
  sort_by_similarity(samples.first(half));
  sort_by_similarity(samples.subspan(half));
}

[[gnu::cold]] void ThinnedImages::set_frame_of(std::uint32_t place) noexcept {
  std::transform(at(place), at(place) + observed_.size(), observed_.begin(),
                 [](std::uint16_t depth) { return depth == empty_cell ? nothing_seen : static_cast<float>(depth); });
  lines_.set_frame(observed_);
}

/// Of some of them.
[[gnu::cold]] std::uint32_t ThinnedImages::farthest_from(std::uint32_t place,
                                                         std::span<const std::uint32_t> places) noexcept {
  constexpr std::size_t most = 256;
  set_frame_of(place);
  std::pair<float, std::uint32_t> farthest{-1.0f, place};
  for (std::size_t i = 0; i < places.size(); i += places.size() / most + 1)
    farthest = std::max(farthest, {distance(places[i]), places[i]});
  return farthest.second;
}

/// The one with the least sum of distances from the others.
[[gnu::cold]] std::uint32_t ThinnedImages::middle_of(std::span<const std::uint32_t> places) noexcept {
  std::pair<float, std::uint32_t> middle{std::numeric_limits<float>::infinity(), places.front()};
  for (const std::uint32_t place : places) {
    set_frame_of(place);
    float sum = 0;
    for (const std::uint32_t other : places) sum += distance(other);
    middle = std::min(middle, {sum, place});
  }
  return middle.second;
}

void ThinnedImages::set_frame(std::span<const float> observed) noexcept {
  std::ranges::transform(cells_, observed_.begin(), [&](std::uint32_t cell) { return observed[cell]; });
  lines_.set_frame(observed_);
  if (!representatives_.empty()) choose_compared();
}

/// Places of the samples in the blocks that are most similar to the frame, of the blocks that are most similar, and so
/// on.
void ThinnedImages::choose_compared() noexcept {
  compared_.resize(representatives_.back().size());
  std::iota(compared_.begin(), compared_.end(), 0u);
  for (std::size_t level = representatives_.size(); level-- > 0;) {
    const std::vector<std::uint32_t>& representative = representatives_[level];
    nearest_.clear();
    for (std::size_t i = 0; i < compared_.size(); ++i) {
      const std::uint32_t next = compared_[std::min(i + 1, compared_.size() - 1)];
      nearest_.offer(compared_[i], lines_.observed_mean(compare(representative[compared_[i]], representative[next])));
    }
    const std::size_t below = level > 0 ? representatives_[level - 1].size() : order_.size();
    compared_.clear();
    for (const RankedSample& one : nearest_.selected(0))
      for (std::uint32_t part = one.sample * block; part < std::min<std::size_t>((one.sample + 1) * block, below);
           ++part)
        compared_.push_back(part);
  }
}

void ThinnedImages::propose(std::span<const float> observed, SelectedSamples& best) noexcept {
  set_frame(observed);
  best.clear();
  visit_compared([&](std::uint32_t sample, float mean) { best.offer(sample, mean); });
}

void ThinnedImages::propose(std::span<const float> observed, BestSamples& best, SelectedSamples& by_whole) noexcept {
  set_frame(observed);
  best.clear();
  by_whole.clear();
  compare_samples([&](std::uint32_t sample, const LineSums& sums) {
    best.offer(sample, lines_.observed_mean(sums));
    by_whole.offer(sample, sums.squares / std::max(sums.filled, 1.0f));
  });
}

}  // namespace lbea
