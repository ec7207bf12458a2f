// Renders the depth images of samples.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"
#include "runtime/src/depth/depth_images.hpp"

namespace lbea::bake {

class DepthRenderer {
 public:
  virtual ~DepthRenderer() = default;
  [[nodiscard]] virtual const DepthCamera& camera() const noexcept = 0;
  /// positions: nodes x 3, reference coordinates; present: per element, 0 = not on the surface, empty: all are; image:
  /// padded_cells(camera()), see DepthImages. Safe from several threads.
  virtual void render(std::span<const float> positions, std::span<const std::uint8_t> present,
                      std::span<std::uint16_t> image) const = 0;
  /// What the sensor measures of the same, without noise, in its coordinates: at most most_points(). Safe from several
  /// threads. A renderer without points renders images alone.
  [[nodiscard]] virtual std::vector<Point> points(std::span<const float> /*positions*/,
                                                  std::span<const std::uint8_t> /*present*/) const {
    return {};
  }
  [[nodiscard]] virtual std::size_t most_points() const noexcept { return 0; }
};

/// Measured on a rail ensemble: finer cells do not find better samples.
struct DepthImageResolution {
  std::uint32_t columns = 90;       // cells across the whole image, about
  std::uint32_t rays_per_cell = 4;  // along each side
};

/// Renders what the stereo sensor measures, in cells of several pixels.
/// low, high: box of all positions that will be rendered, reference coordinates; the images are cropped to it.
/// Throws as VirtualSensor does, and Error{bad_config} when the sensor does not see the box.
[[nodiscard]] std::unique_ptr<DepthRenderer> make_depth_renderer(const StereoSensor& sensor, std::size_t nodes,
                                                                 std::span<const std::array<std::uint32_t, 4>> elements,
                                                                 const std::array<float, 3>& low,
                                                                 const std::array<float, 3>& high,
                                                                 const DepthImageResolution& resolution = {});

}  // namespace lbea::bake
