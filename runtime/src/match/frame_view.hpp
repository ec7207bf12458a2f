// The frame as the depth images' camera would have taken it.
#pragma once

#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/model/view_data.hpp"

#include <span>
#include <vector>

namespace lbea {

class FrameView {
 public:
  /// All memory is allocated here.
  explicit FrameView(const ViewCamera& camera);

  /// The mean depth of the indexed points in every cell, in depth steps; nothing_seen where fewer fall than a quarter
  /// of what a filled cell holds on average: edges that a single outlier reaches are not surface. No allocation.
  void build(const CloudIndex& index) noexcept;
  /// padded_cells() values.
  [[nodiscard]] std::span<float> cells() noexcept { return cells_; }

 private:
  CellRaster raster_;
  RigidTransform T_sensor_reference_;
  std::vector<CellTally> tallies_;  // one more than there are cells: for what lies outside
  std::vector<float> points_, cells_;
};

}  // namespace lbea
