#include "runtime/src/match/view_ranking.hpp"

#include <algorithm>

namespace lbea {

ViewRanking::ViewRanking(const ViewCamera& camera, std::uint32_t capacity, const ViewMetric& metric)
    : code_(kernels()),
      prices_{metric.cap / camera.depth_step, metric.one_sided / camera.depth_step},
      best_(capacity),
      chosen_(capacity),
      common_(padded_cells(camera)) {}

void ViewRanking::rank(std::span<float> observed, std::span<const std::uint16_t> depths,
                       std::span<const RankedSample> proposed) noexcept {
  compare(observed, depths, proposed);
  hide(observed, depths);
  const auto chosen = std::span(chosen_).first(ranked().size());
  std::ranges::copy(ranked(), chosen.begin());
  compare(observed, depths, chosen);
}

void ViewRanking::compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
                          std::span<const RankedSample> proposed) noexcept {
  best_.clear();
  for (const RankedSample& proposal : proposed) {
    const CellSums sums =
        code_.compare_views(observed.data(), &depths[proposal.sample * observed.size()], observed.size(), prices_);
    best_.offer(proposal.sample, sums.squares / std::max(sums.filled, 1.0f));
  }
}

void ViewRanking::hide(std::span<float> observed, std::span<const std::uint16_t> depths) noexcept {
  std::ranges::fill(common_, std::uint16_t{1});
  for (const RankedSample& best : ranked()) {
    const std::uint16_t* image = &depths[best.sample * observed.size()];
    for (std::size_t c = 0; c < common_.size(); ++c)
      common_[c] = static_cast<std::uint16_t>(common_[c] & (image[c] != empty_cell));
  }
  for (std::size_t c = 0; c < common_.size(); ++c)
    if (common_[c] != 0 && observed[c] == nothing_seen) observed[c] = not_observed;
}

}  // namespace lbea
