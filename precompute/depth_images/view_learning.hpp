// How well do simulations explain one another, seen from the sensor? Learnt from the depth images of all samples.
#pragma once

#include "precompute/depth_images/misfit.hpp"
#include "runtime/src/depth/depth_images.hpp"

#include <lbea/lbea.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace lbea::bake {

struct LearntViews {
  std::vector<float> expected;  // s: the residual that an unseen run leaves at this sample's time step
  MisfitLimits limits;
};

/// Fills `images` with those of the samples from `first` on, padded_cells() each; called from any thread.
using ImageReader = std::function<void(std::size_t first, std::span<std::uint16_t> images)>;

/// samples: ascending. Every sample (of many, every k-th) is held against all samples of the other simulations: what is
/// left is what an unseen run leaves. The images are read once, a few at a time; the memory does not grow with them.
[[nodiscard]] LearntViews learn_views(const DepthCamera& camera, std::span<const Sample> samples,
                                      const ImageReader& read, unsigned threads);

}  // namespace lbea::bake
