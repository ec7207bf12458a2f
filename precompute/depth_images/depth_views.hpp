// Renders samples as the stereo sensor would see them, in cells of several pixels.
#pragma once

#include "precompute/depth_images/view_renderer.hpp"
#include "precompute/rig/stereo_sensor.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace lbea::bake {

/// Measured on a rail ensemble: finer cells find no better samples, and cost more.
struct ViewResolution {
  std::uint32_t columns = 90;       // cells across the whole image, about
  std::uint32_t rays_per_cell = 4;  // along each side
};

/// low, high: box of all positions that will be rendered, reference coordinates: cells beyond it are left out.
/// Throws as VirtualSensor does, and Error{bad_config} when the box is out of the sensor's sight.
[[nodiscard]] std::unique_ptr<ViewRenderer> depth_views(const StereoSensor& sensor, std::size_t nodes,
                                                        std::span<const std::array<std::uint32_t, 4>> elements,
                                                        const std::array<float, 3>& low,
                                                        const std::array<float, 3>& high,
                                                        const ViewResolution& resolution = {});

}  // namespace lbea::bake
