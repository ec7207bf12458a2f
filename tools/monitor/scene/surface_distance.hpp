// How far measured points lie from a mesh: for colours, so distances beyond a limit are not told apart.
#pragma once

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::tool {

/// Over one shape of a mesh whose elements stay the same: `elements` x 4 node indices, a triangle repeats its last
/// node.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(std::span<const std::uint32_t> element_nodes, std::uint32_t nodes);
  /// nodes x 3. `limit` > 0: larger distances are reported as the limit.
  void set_shape(std::span<const float> positions, float limit);
  /// From the nearest node's elements, which on meshes of well-shaped elements is the distance from the surface.
  [[nodiscard]] float at(const Point& point) const noexcept;
  [[nodiscard]] float limit() const noexcept { return limit_; }

 private:
  struct Nearest {
    std::uint32_t node;
    float squared;
  };
  [[nodiscard]] std::int64_t cell_along(float value, std::size_t axis) const noexcept;
  [[nodiscard]] Nearest nearest_node(const Point& point) const noexcept;
  [[nodiscard]] float to_elements(std::uint32_t node, const Point& point) const noexcept;

  std::span<const std::uint32_t> element_nodes_;
  std::uint32_t nodes_;
  std::vector<std::uint32_t> first_element_,
      elements_;  // of every node: elements_[first_element_[i] ... first_element_[i + 1]]
  std::span<const float> positions_;
  float limit_ = 0, cell_ = 1;
  std::array<float, 3> lo_{};
  std::array<std::int64_t, 3> cells_{};
  std::vector<std::uint32_t> first_node_, sorted_nodes_;  // of every cell, the same way
};

}  // namespace lbea::tool
