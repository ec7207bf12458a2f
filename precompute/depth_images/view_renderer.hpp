// What renders a sample's depth image. The one that does is in precompute/rig: only programs that need it link a ray
// caster.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

#include <cstdint>
#include <span>

namespace lbea::bake {

class ViewRenderer {
 public:
  virtual ~ViewRenderer() = default;
  [[nodiscard]] virtual const DepthCamera& camera() const noexcept = 0;
  /// positions: nodes x 3, reference coordinates; image: padded_cells(camera()), see DepthImages. Safe from several
  /// threads.
  virtual void render(std::span<const float> positions, std::span<std::uint16_t> image) const = 0;
};

}  // namespace lbea::bake
