// A frame's depth image with the parts that something may hide taken from the combination of candidates, so that the
// whole of it can predict the shape.
#pragma once

#include "runtime/src/depth/depth_images.hpp"

namespace lbea {

class CompletedImage {
 public:
  /// Allocates all memory.
  explicit CompletedImage(const DepthCamera& camera);
  void clear() noexcept;
  /// A candidate and its share in the combination. residuals: its own; hidden_price: those in its hidden parts.
  void add(float share, std::span<const std::uint16_t> image, std::span<const float> residuals,
           float hidden_price) noexcept;
  /// observed: limited to its Surroundings. Cells that are not observed, or hidden parts of most of the combination,
  /// get the combination's depth, if most of it fills them.
  void finish(std::span<const float> observed) noexcept;
  /// padded_cells() depths in steps.
  [[nodiscard]] std::span<const float> cells() const noexcept { return cells_; }

 private:
  std::vector<float> cells_, filled_, hidden_;  // sums of depths and of shares
};

}  // namespace lbea
