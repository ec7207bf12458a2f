// Shapes at a few nodes: of the whole component, hidden parts included, enough for mean distances; or of its observed
// surface.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

inline constexpr std::uint32_t most_component_places = 128, most_surface_places = 256;

/// Which nodes: at most so many of the whole component, or of the observed surface.
enum class LandmarkPlaces : std::uint8_t { component, surface };

class ShapeLandmarks {
 public:
  /// Copies those of all samples, unless that needs more than `most_bytes`.
  explicit ShapeLandmarks(const ModelView& model, LandmarkPlaces places = LandmarkPlaces::component,
                          std::size_t most_bytes = std::size_t{256} << 20);

  [[nodiscard]] std::size_t nodes() const noexcept { return places_.size(); }
  /// Floats of a plane, and of a shape: x, y and z planes, padded with zeros to whole 64-byte lines.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
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
