#include "runtime/src/depth/depth_ranking.hpp"

#include <algorithm>
#include <cstring>

namespace lbea {

namespace {

/// The bits at 0, 8, ..., 56, as the lowest eight.
std::uint64_t packed(std::uint64_t bytes) noexcept { return bytes * 0x0102040810204080 >> 56; }

}  // namespace

HiddenParts::HiddenParts(const DepthCamera& camera)
    : columns_(camera.columns),
      rows_(camera.rows),
      words_((camera.columns + margin + bits_of_word - 1) / bits_of_word),
      in_row_(bits_of_word * words_),
      empty_((camera.rows + 2 * margin) * words_ + 1),
      allowed_(empty_.size()),
      parts_(empty_.size()) {}

template <class IsSet>
void HiddenParts::set_row(std::vector<std::uint64_t>& into, std::size_t row, const IsSet& is_set) noexcept {
  const std::size_t columns = columns_, first = row * columns;  // bytes alias members: they would be read for each cell
  std::uint8_t* const cells = in_row_.data();
  for (std::size_t column = 0; column < columns; ++column) cells[column] = is_set(first + column) ? 1 : 0;
  for (std::size_t word = 0; word < words_; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t byte = 0; byte < 8; ++byte) {
      std::uint64_t eight;
      std::memcpy(&eight, cells + bits_of_word * word + 8 * byte, sizeof(eight));
      bits |= packed(eight) << 8 * byte;
    }
    into[at(row) + word] = bits;
  }
}

void HiddenParts::set_frame(std::span<const float> observed) noexcept {
  are_known_ = false;
  for (std::size_t row = 0; row < rows_; ++row)
    set_row(empty_, row, [observed](std::size_t cell) { return observed[cell] < 0; });
}

void HiddenParts::set_frame_with_known_parts(std::span<const float> observed) noexcept {
  set_frame(observed);
  are_known_ = true;
  for (std::size_t row = 0; row < rows_; ++row)
    set_row(allowed_, row, [observed](std::size_t cell) { return observed[cell] == not_observed; });
}

/// Opening by squares: what squares of `width` cells inside the differing cells cover.
std::size_t HiddenParts::find(std::span<const std::uint16_t> image) noexcept {
  static_assert(width == 5);
  const std::uint16_t* const filled = image.data();
  for (std::size_t row = 0; row < rows_; ++row)
    set_row(parts_, row, [filled](std::size_t cell) { return filled[cell] != empty_cell; });
  const std::size_t begin = at(0), end = at(rows_), below = words_;
  std::uint64_t* const parts = parts_.data();
  filled_by_both_ = 0;
  for (std::size_t i = begin; i < end; ++i) {
    filled_by_both_ += static_cast<std::size_t>(std::popcount(parts[i] & ~empty_[i]));
    parts[i] &= empty_[i];
  }
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint64_t bits = parts[i], next = parts[i + 1];
    parts[i] = bits & (bits >> 1 | next << 63) & (bits >> 2 | next << 62) & (bits >> 3 | next << 61) &
               (bits >> 4 | next << 60);
  }
  std::uint64_t any = 0;
  for (std::size_t i = begin; i < end; ++i)
    any |= parts[i] &= parts[i + below] & parts[i + 2 * below] & parts[i + 3 * below] & parts[i + 4 * below];
  if (any == 0) return 0;
  for (std::size_t i = end; i-- > begin;)
    parts[i] |= parts[i - below] | parts[i - 2 * below] | parts[i - 3 * below] | parts[i - 4 * below];
  std::size_t count = 0;
  for (std::size_t i = end; i-- > begin;) {
    const std::uint64_t bits = parts[i], last = parts[i - 1];
    parts[i] = bits | bits << 1 | last >> 63 | bits << 2 | last >> 62 | bits << 3 | last >> 61 | bits << 4 | last >> 60;
    if (are_known_) parts[i] &= allowed_[i];
    if (parts[i] != 0) count += static_cast<std::size_t>(std::popcount(parts[i]));
  }
  return count;
}

HiddenCells::HiddenCells(const DepthCamera& camera)
    : columns_(camera.columns), rows_(camera.rows), is_hidden_(camera.cells()) {}

void HiddenCells::reset() noexcept {
  std::ranges::fill(is_hidden_, std::uint8_t{0});
  count_ = 0;
}

bool HiddenCells::is_confirmed_by(std::span<const float> frame) const noexcept {
  constexpr std::size_t least_per_shown = 4;
  std::size_t shown = 0;
  for (std::size_t c = 0; c < is_hidden_.size(); ++c) shown += frame[c] >= 0 ? is_hidden_[c] : 0u;
  return count_ > least_per_shown * shown;
}

void HiddenCells::remove_shown(std::span<const float> frame) noexcept {
  count_ = 0;
  for (std::size_t c = 0; c < is_hidden_.size(); ++c) {
    if (frame[c] >= 0) is_hidden_[c] = 0;
    count_ += is_hidden_[c];
  }
}

void HiddenCells::add(const HiddenParts& parts) noexcept {
  parts.visit([this](std::size_t cell) {
    if (is_hidden_[cell] == 0) ++count_;
    is_hidden_[cell] = 1;
  });
}

void HiddenCells::exclude_from(std::span<float> frame) const noexcept {
  constexpr std::size_t reach = Surroundings::reach;
  for (std::size_t row = 0; row < rows_; ++row)
    for (std::size_t column = 0; column < columns_; ++column) {
      if (is_hidden_[row * columns_ + column] == 0) continue;
      for (std::size_t r = std::max(row, reach) - reach; r <= std::min(row + reach, rows_ - 1); ++r)
        for (std::size_t c = std::max(column, reach) - reach; c <= std::min(column + reach, columns_ - 1); ++c)
          if (float& cell = frame[r * columns_ + c]; cell == nothing_seen) cell = not_observed;
    }
}

[[gnu::cold]]  // compiled for size
void set_depth_costs(std::span<float> mean_squares, float noise) noexcept {
  constexpr float half_n_of_shapes = 0.5f, half_n_of_noise = 5;
  constexpr float share_of_noise = 0.01f;  // the noise of the metric includes that of the outline
  const float variance = share_of_noise * noise, least = *std::ranges::min_element(mean_squares) + variance;
  const float half_n = half_n_of_shapes + half_n_of_noise * variance / least;
  for (float& mean : mean_squares) mean = half_n * static_cast<float>(logarithm((mean + variance) / least));
}

[[gnu::cold]]  // compiled for size
DepthRanking::DepthRanking(const DepthCamera& camera, std::uint32_t capacity, const DepthMetric& metric,
                           std::uint32_t most_proposed, float sharpness)
    : code_(kernels()),
      camera_(camera),
      prices_(prices_of(metric, camera)),
      hidden_price_(metric.hidden / camera.depth_step),
      noise_(square(metric.mesh_noise / camera.depth_step)),
      sharpness_(sharpness),
      compared_(most_proposed),
      best_(capacity),
      chosen_(capacity),
      common_(padded_cells(camera)),
      any_(padded_cells(camera)),
      lines_(padded_cells(camera), prices_),
      nearly_best_(capacity + spare),
      promising_(most_promising),
      depth_costs_(promising_.capacity()),
      whole_(padded_cells(camera)),
      parts_(camera) {}

float DepthRanking::rank(std::span<float> observed, std::span<const std::uint16_t> depths,
                         std::span<const RankedSample> proposed, const ExpectationCosts* costs,
                         std::span<const std::uint32_t> filled_cells) noexcept {
  const bool is_whole = std::ranges::find(observed, not_observed) == observed.end();
  if (is_whole && !filled_cells.empty()) {
    find_nearly_best(observed, depths, proposed, filled_cells);
    proposed = nearly_best_.ranked();
  }
  compare(observed, depths, proposed);
  choose(best_, nullptr);
  const float least = ranked()[0].distance;
  find_common(depths, ranked(), common_);
  for (std::size_t c = 0; c < common_.size(); ++c)
    if (common_[c] != 0 && observed[c] == nothing_seen) observed[c] = not_observed;
  const auto chosen = std::span(chosen_).first(ranked().size());
  std::ranges::copy(ranked(), chosen.begin());
  compare(observed, depths, chosen);
  choose(best_, costs);
  return least;
}

float DepthRanking::rank_hidden(std::span<const float> observed, std::span<const std::uint16_t> depths,
                                std::span<const RankedSample> proposed, const ExpectationCosts* costs,
                                bool knows_parts) noexcept {
  const std::size_t stride = observed.size();
  set_frame(observed, true, knows_parts);
  compare(observed, depths, proposed);
  choose(promising_, costs);
  compared_count_ = 0;
  for (const RankedSample& one : promising_.ranked()) {
    const SquareSums sums = compare(depths.subspan(one.sample * stride, stride));
    depth_costs_[compared_count_] = sums.mean_of_depths();
    compared_[compared_count_++] = {one.sample, sums.mean()};
  }
  const auto depth_costs = std::span(depth_costs_).first(compared_count_);
  set_depth_costs(depth_costs, noise_);
  choose(best_, costs, depth_costs);
  find_common(depths, ranked(), common_);
  return ranked()[0].distance - compare_shown(depths.subspan(ranked()[0].sample * stride, stride)).mean();
}

[[gnu::cold]] void DepthRanking::use(const DepthMetric& metric) noexcept {
  prices_ = prices_of(metric, camera_);
  hidden_price_ = metric.hidden / camera_.depth_step;
}

void DepthRanking::set_frame(std::span<const float> observed, bool is_hidden, bool knows_parts) noexcept {
  observed_ = observed;
  is_hidden_ = is_hidden;
  if (!is_hidden) return;
  std::ranges::transform(observed, whole_.begin(), [](float depth) { return depth < 0 ? nothing_seen : depth; });
  shown_cells_ = static_cast<float>(std::ranges::count_if(observed, [](float depth) { return depth >= 0; }));
  if (knows_parts)
    parts_.set_frame_with_known_parts(observed);
  else
    parts_.set_frame(observed);
}

SquareSums DepthRanking::compare(std::span<const std::uint16_t> image) noexcept {
  if (!is_hidden_) {
    const CellSums sums = code_.compare_depths(observed_.data(), image.data(), image.size(), prices_);
    return {sums.squares, 0, std::max(sums.filled, 1.0f)};
  }
  const CellSums sums = code_.compare_depths(whole_.data(), image.data(), image.size(), {prices_.cap, 0});
  const auto hidden = static_cast<float>(parts_.find(image)), both = static_cast<float>(parts_.filled_by_both());
  const float one_sided = square(prices_.one_sided);
  return {sums.squares + one_sided * std::max(sums.filled - both - hidden, 0.0f), square(hidden_price_) * hidden,
          std::max(sums.filled - hidden, 1.0f), sums.squares + square(hidden_price_) * (shown_cells_ - both),
          std::max(shown_cells_, 1.0f)};
}

SquareSums DepthRanking::compare_shown(std::span<const std::uint16_t> image) noexcept {
  if (!is_hidden_) return compare(image);
  for (std::size_t c = 0; c < whole_.size(); ++c)
    whole_[c] = common_[c] != 0 && observed_[c] == nothing_seen ? not_observed : observed_[c];
  parts_.find(image);
  parts_.visit([this](std::size_t cell) { whole_[cell] = not_observed; });
  const CellSums sums = code_.compare_depths(whole_.data(), image.data(), image.size(), prices_);
  return {sums.squares, 0, std::max(sums.filled, 1.0f)};
}

float DepthRanking::price_hidden(std::span<const float> observed, std::span<const std::uint16_t> image,
                                 std::span<float> residuals, bool has_price) noexcept {
  float count = 0;
  parts_.find(image);
  parts_.visit([&](std::size_t cell) {
    if (observed[cell] != nothing_seen) return;
    residuals[cell] = has_price ? hidden_price_ : 0;
    ++count;
  });
  return count;
}

const HiddenParts& DepthRanking::hidden_parts(std::span<const float> frame,
                                              std::span<const std::uint16_t> depths) noexcept {
  std::ranges::fill(any_, empty_cell);
  for (const RankedSample& best : ranked()) {
    const std::uint16_t* image = &depths[best.sample * any_.size()];
    for (std::size_t c = 0; c < any_.size(); ++c) any_[c] = static_cast<std::uint16_t>(any_[c] | image[c]);
  }
  parts_.set_frame(frame);
  parts_.find(any_);
  return parts_;
}

/// A sample is given up when it cannot be among them any more. Faster when the first ones are good.
void DepthRanking::find_nearly_best(std::span<const float> observed, std::span<const std::uint16_t> depths,
                                    std::span<const RankedSample> proposed,
                                    std::span<const std::uint32_t> filled_cells) noexcept {
  const std::size_t stride = observed.size(), count = std::min(proposed.size(), compared_.size());
  const float one_sided = square(prices_.one_sided);
  const auto image = [&](std::size_t i) { return &depths[proposed[i].sample * stride]; };
  lines_.set_filled_lines(observed);
  nearly_best_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const LineSums sums = lines_.compare(code_, image(i), nearly_best_.bound(), image(std::min(i + 1, count - 1)));
    if (!std::isfinite(sums.squares)) continue;
    const std::uint32_t sample = proposed[i].sample;
    const float beside = static_cast<float>(filled_cells[sample]) - sums.counted;
    nearly_best_.offer(sample, (sums.squares + one_sided * beside) / std::max(sums.filled + beside, 1.0f));
  }
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
void DepthRanking::choose(BestSamples& best, const ExpectationCosts* costs,
                          std::span<const float> depth_costs) noexcept {
  const auto compared = std::span(compared_).first(compared_count_);
  float least = std::numeric_limits<float>::infinity();
  for (const RankedSample& one : compared) least = std::min(least, one.distance);
  price_per_cost_ = (least + noise_) / sharpness_;
  best.clear();
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const auto& [sample, mean] = compared[i];
    const float cost = (costs != nullptr ? (*costs)[sample] : 0) + (depth_costs.empty() ? 0 : depth_costs[i]);
    best.offer(sample, mean + price_per_cost_ * cost);
  }
}

}  // namespace lbea
