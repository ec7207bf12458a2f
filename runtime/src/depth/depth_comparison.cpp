#include "runtime/src/depth/depth_comparison.hpp"

#include <algorithm>

namespace lbea {
namespace {

RigidTransform inverse(const RigidTransform& T) noexcept {
  RigidTransform inverted;
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      inverted[4 * i + k] = T[4 * k + i];
      shift -= double{T[4 * k + i]} * double{T[4 * k + 3]};
    }
    inverted[4 * i + 3] = static_cast<float>(shift);
  }
  return inverted;
}

}  // namespace

FrameDepthImage::FrameDepthImage(const DepthCamera& camera)
    : raster_{camera.focal,          camera.center_column, camera.center_row, camera.depth_origin,
              1 / camera.depth_step, camera.columns,       camera.rows},
      T_sensor_reference_(inverse(camera.T_reference_sensor)),
      tallies_(camera.cells() + 1),
      points_(camera.cells()),
      cells_(padded_cells(camera), nothing_seen) {}

void FrameDepthImage::build(const CloudIndex& index) noexcept {
  std::ranges::fill(tallies_, CellTally{});
  index.add_depths(T_sensor_reference_, raster_, tallies_.data());
  const std::size_t cells = points_.size();
  float points = 0, filled = 0;
  const auto total = [](const float(&four)[4]) { return (four[0] + four[1]) + (four[2] + four[3]); };
  for (std::size_t c = 0; c < cells; ++c) {
    points += points_[c] = total(tallies_[c].points);
    filled += points_[c] > 0 ? 1.0f : 0.0f;
  }
  constexpr float share_of_mean = 0.25f;
  const float fewest = share_of_mean * points / std::max(filled, 1.0f);
  for (std::size_t c = 0; c < cells; ++c)
    cells_[c] = points_[c] > 0 && points_[c] >= fewest ? total(tallies_[c].depth) / points_[c] : nothing_seen;
}

DepthRanking::DepthRanking(const DepthCamera& camera, std::uint32_t capacity, const DepthMetric& metric)
    : code_(kernels()),
      prices_{metric.cap / camera.depth_step, metric.one_sided / camera.depth_step},
      best_(capacity),
      chosen_(capacity),
      common_(padded_cells(camera)) {}

void DepthRanking::rank(std::span<float> observed, std::span<const std::uint16_t> depths,
                        std::span<const RankedSample> proposed) noexcept {
  compare(observed, depths, proposed);
  mark_occluded(observed, depths);
  const auto chosen = std::span(chosen_).first(ranked().size());
  std::ranges::copy(ranked(), chosen.begin());
  compare(observed, depths, chosen);
}

void DepthRanking::compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
                           std::span<const RankedSample> proposed) noexcept {
  best_.clear();
  for (const RankedSample& proposal : proposed) {
    const CellSums sums =
        code_.compare_depths(observed.data(), &depths[proposal.sample * observed.size()], observed.size(), prices_);
    best_.offer(proposal.sample, sums.squares / std::max(sums.filled, 1.0f));
  }
}

void DepthRanking::mark_occluded(std::span<float> observed, std::span<const std::uint16_t> depths) noexcept {
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
