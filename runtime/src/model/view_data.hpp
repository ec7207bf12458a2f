// What the sensor would see of every sample: depth images, coarse enough to compare hundreds of them per frame.
#pragma once

#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace lbea {

/// The sensor's left camera with its pixels taken together in square cells; column 0, row 0 is the cell at the corner
/// of the part of the image that any sample can fill.
struct ViewCamera {
  RigidTransform T_reference_sensor = identity_transform;
  float focal = 0;                          // in cells
  float centre_column = 0, centre_row = 0;  // of the principal point, in cells from the corner
  float depth_origin = 0, depth_step = 1;   // depth = origin + step * stored value, length unit
  std::uint32_t columns = 0, rows = 0;

  [[nodiscard]] std::size_t cells() const noexcept { return std::size_t{columns} * rows; }
};

/// Rows of `depths` are padded with empty cells to whole 64-byte lines.
[[nodiscard]] inline std::size_t padded_cells(const ViewCamera& camera) noexcept {
  return (camera.cells() + 31) / 32 * 32;
}
inline constexpr std::uint16_t empty_cell = 0;

struct ViewData {
  ViewCamera camera;
  std::span<const std::uint16_t> depths;  // s x padded_cells
  std::span<const float> expected;        // s: residual that an unseen run leaves at this time step, median
  float misfit_limit = 0;                 // of one frame
  float test_misfit_limit = 0;            // of the geometric mean over a test
  std::shared_ptr<const void> owner;      // of the memory behind the spans

  [[nodiscard]] std::span<const std::uint16_t> of_sample(std::size_t sample) const noexcept {
    const std::size_t stride = padded_cells(camera);
    return depths.subspan(sample * stride, stride);
  }
};

/// How two depth images are told apart; measured on left-out runs of a rail ensemble, where these gave the least EE.
struct ViewMetric {
  float cap = 40;        // length unit: a cell where both see something counts no more than this,
  float one_sided = 25;  // and this much where only one does: the silhouette
  float mesh_noise = 1;  // what sampling a curved surface by cells leaves between a frame and its own sample
};

}  // namespace lbea
