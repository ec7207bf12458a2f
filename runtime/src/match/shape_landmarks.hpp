// Shapes of the whole component, hidden parts included, at a few of its nodes: enough for mean distances.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

class ShapeLandmarks {
 public:
  /// Copies those of all samples, unless that needs more than `most_bytes`.
  explicit ShapeLandmarks(const ModelView& model, std::size_t most_bytes = std::size_t{256} << 20);

  /// Floats of a shape: x, y and z planes, padded with zeros to whole 64-byte lines.
  [[nodiscard]] std::size_t size() const noexcept { return 3 * stride_; }
  /// Of a sample; in `buffer`, of size() floats, unless copies are allowed and exist. Does not allocate.
  [[nodiscard]] std::span<const float> of(std::uint32_t sample, bool copies, std::span<float> buffer) const noexcept;
  /// Of the nodes of two shapes.
  [[nodiscard]] float mean_distance(std::span<const float> a, std::span<const float> b) const noexcept;

 private:
  void read(std::uint32_t sample, std::span<float> into) const noexcept;

  const ModelView& model_;
  const Kernels& code_;
  std::vector<std::uint32_t> places_;  // in a sample's positions
  std::size_t stride_;
  std::vector<float> copies_;
};

}  // namespace lbea
