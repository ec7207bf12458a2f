// The depth images of a finished model's samples, for another pose or another sensor than it was baked for.
#pragma once

#include "precompute/parallel.hpp"
#include "precompute/rig/depth_renderer.hpp"

#include <lbea/lbea.hpp>

#include <functional>

namespace lbea::bake {

/// Renders the depth images of a finished model's samples, for another pose than the one it was baked for.
/// progress, when given, is called with the number of samples done, from any thread.
[[nodiscard]] SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, const Workers& workers,
                                              const std::function<void(std::size_t done)>& progress = {});

/// Renders the image of a sample: padded_cells(camera). Safe from several threads.
using SampleRenderer = std::function<void(std::uint32_t sample, std::span<std::uint16_t> image)>;

/// The same with images that show more than the component.
[[nodiscard]] SensorViews render_depth_images(const Model& model, const DepthCamera& camera,
                                              const SampleRenderer& render, const Workers& workers,
                                              const std::function<void(std::size_t done)>& progress = {});

}  // namespace lbea::bake
