// The depth images of a finished model's samples, for another pose than the one it was baked for.
#pragma once

#include "precompute/depth_images/view_renderer.hpp"

#include <lbea/lbea.hpp>

#include <cstddef>
#include <functional>

namespace lbea::bake {

/// The views of a model that was baked for another pose, or for none: rendered anew from its samples.
/// `progress`, when given, is called with the number of samples done, from any thread.
[[nodiscard]] SensorViews render_views(const Model& model, const ViewRenderer& renderer, unsigned threads,
                                       const std::function<void(std::size_t done)>& progress = {});

}  // namespace lbea::bake
