// The frame as a depth image, and the ranking of the samples by how well their depth images explain it.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/sample_search.hpp"

namespace lbea {

/// The frame as the camera of the samples' depth images would have taken it.
class FrameDepthImage {
 public:
  /// Allocates all memory.
  explicit FrameDepthImage(const DepthCamera& camera);

  /// Sets every cell to the mean depth of the indexed points in it, in depth steps. A cell with less than a quarter of
  /// the points that a filled cell holds on average becomes nothing_seen: a single outlier at an edge is no surface.
  /// Does not allocate.
  void build(const CloudIndex& index) noexcept;
  /// padded_cells() values.
  [[nodiscard]] std::span<float> cells() noexcept { return cells_; }

 private:
  CellRaster raster_;
  RigidTransform T_sensor_reference_;
  std::vector<CellTally> tallies_;  // one more than there are cells, for points outside
  std::vector<float> points_, cells_;
};

class DepthRanking {
 public:
  /// Keeps the best `capacity` samples. Allocates all memory.
  DepthRanking(const DepthCamera& camera, std::uint32_t capacity, const DepthMetric& metric);

  /// observed: padded_cells() depths in steps; depths: the images of all samples; proposed: the samples to rank.
  /// A cell that all of the best samples fill and the frame does not is regarded as occluded, not as a hole in the
  /// component: it becomes `not_observed` and is ignored from then on. Does not allocate.
  void rank(std::span<float> observed, std::span<const std::uint16_t> depths,
            std::span<const RankedSample> proposed) noexcept;

  /// Best first. distance: mean square over the cells that either image fills, in squared depth steps.
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept { return best_.ranked(); }
  [[nodiscard]] std::size_t capacity() const noexcept { return best_.capacity(); }
  [[nodiscard]] const CellPrices& prices() const noexcept { return prices_; }

 private:
  void compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
               std::span<const RankedSample> proposed) noexcept;
  void mark_occluded(std::span<float> observed, std::span<const std::uint16_t> depths) noexcept;

  const Kernels& code_;
  CellPrices prices_;  // in depth steps
  BestSamples best_;
  std::vector<RankedSample> chosen_;
  std::vector<std::uint16_t> common_;  // per cell: 0 where the image of any of the best is empty
};

}  // namespace lbea
