// Shapes at a few nodes: of the whole component, hidden parts included, enough for mean distances; or of its observed
// surface, with the middles of some of its open edges.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

inline constexpr std::uint32_t most_component_places = 128, most_surface_places = 256, most_edge_places = 24;

/// Which nodes: at most so many of the whole component, or of the observed surface.
enum class LandmarkPlaces : std::uint8_t { component, surface };

/// Places at which points are compared. Of the last 3 x edges, the first are the middles of the opposite sides of the
/// elements at open edges of the mesh, then come a node of each edge, and the middles of the edges.
struct SurfacePlaces {
  std::vector<std::array<std::uint32_t, 2>> between;  // two nodes, whose middle is the place; a node itself: twice
  std::size_t edges = 0;

  [[nodiscard]] static std::array<float, 3> middle(const float* a, const float* b) noexcept {
    return {0.5f * (a[0] + b[0]), 0.5f * (a[1] + b[1]), 0.5f * (a[2] + b[2])};
  }
};
/// Of the observed surface, whose nodes are `vertex_nodes`, of a mesh of so many nodes. No edges if the model stores
/// landmarks, which do not include them.
[[nodiscard]] SurfacePlaces surface_places(std::span<const std::uint32_t> vertex_nodes,
                                           std::span<const std::array<std::uint32_t, 4>> element_nodes,
                                           std::size_t nodes, bool has_landmarks);

/// Of planes of x, y and z.
inline std::array<float, 3> vector_at(std::span<const float> planes, std::size_t stride, std::size_t i) noexcept {
  return {planes[i], planes[stride + i], planes[2 * stride + i]};
}

class ShapeLandmarks {
 public:
  /// Copies those of all samples, unless that needs more than `most_bytes`.
  explicit ShapeLandmarks(const ModelView& model, LandmarkPlaces places = LandmarkPlaces::component,
                          std::size_t most_bytes = std::size_t{256} << 20);

  [[nodiscard]] std::size_t nodes() const noexcept { return places_.between.size(); }
  [[nodiscard]] std::size_t edges() const noexcept { return places_.edges; }
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
  SurfacePlaces places_;  // in a sample's positions
  std::size_t stride_;
  std::vector<float> copies_;
};

}  // namespace lbea
