#include "runtime/src/match/frame_view.hpp"

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

FrameView::FrameView(const ViewCamera& camera)
    : raster_{camera.focal,          camera.centre_column, camera.centre_row, camera.depth_origin,
              1 / camera.depth_step, camera.columns,       camera.rows},
      T_sensor_reference_(inverse(camera.T_reference_sensor)),
      tallies_(camera.cells() + 1),
      points_(camera.cells()),
      cells_(padded_cells(camera), nothing_seen) {}

void FrameView::build(const CloudIndex& index) noexcept {
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

}  // namespace lbea
