// The depth images of the samples: what the sensor would see of each, coarse enough to compare hundreds per frame.
#pragma once

#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <cmath>

namespace lbea {

class SectionReader;

/// The sensor's left camera with its pixels combined into square cells. Cell (0, 0) is the corner of the part of the
/// image that any sample can fill.
struct DepthCamera {
  RigidTransform T_reference_sensor = identity_transform;
  float focal = 0;                          // in cells
  float center_column = 0, center_row = 0;  // of the principal point, in cells from the corner
  float depth_origin = 0, depth_step = 1;   // depth = origin + step * stored value, length unit
  std::uint32_t columns = 0, rows = 0;

  [[nodiscard]] std::size_t cells() const noexcept { return std::size_t{columns} * rows; }
};

/// Each image in `depths` is padded with empty cells to whole 64-byte lines.
[[nodiscard]] inline std::size_t padded_cells(const DepthCamera& camera) noexcept {
  return (camera.cells() + 31) / 32 * 32;
}
inline constexpr std::uint16_t empty_cell = 0;

/// What SensorViews shares: the images of all samples and the residuals to expect.
struct DepthImages {
  DepthCamera camera;
  std::span<const std::uint16_t> depths;  // s x padded_cells
  std::span<const float> expected;        // s: median residual of a run that is not in the ensemble, at this time step
  float misfit_limit = 0;                 // of one frame
  float test_misfit_limit = 0;            // of the geometric mean over a test
  std::shared_ptr<const void> owner;      // of the memory behind the spans

  [[nodiscard]] std::span<const std::uint16_t> of_sample(std::size_t sample) const noexcept {
    const std::size_t stride = padded_cells(camera);
    return depths.subspan(sample * stride, stride);
  }
};

/// Reads sections 64 to 67. Null when the file has none. Throws Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const DepthImages> read_depth_images(const SectionReader& sections,
                                                                   const format::Info& info);

/// How two depth images are compared. The values gave the least EE on left-out runs of a rail ensemble.
struct DepthMetric {
  float cap = 40;        // length unit: greatest cost of a cell that both images fill
  float one_sided = 25;  // cost of a cell that only one image fills: the silhouette
  float mesh_noise = 1;  // residual between a frame and its own sample, from sampling a curved surface by cells
};

/// Plausibility of a sample by its residual r: exp(-sharpness * (r^2 - best^2) / (best^2 + noise^2)).
template <typename Real>
class Plausibility {
 public:
  Plausibility(float best_residual, float noise, float sharpness) noexcept
      : best_(square(best_residual)), scale_(best_ + square(noise)), sharpness_{sharpness} {}
  [[nodiscard]] Real operator()(float residual) const noexcept {
    return std::exp(-sharpness_ * (square(residual) - best_) / scale_);
  }

 private:
  static Real square(float v) noexcept { return Real{v} * Real{v}; }
  Real best_, scale_, sharpness_;
};

}  // namespace lbea
