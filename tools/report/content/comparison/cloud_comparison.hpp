// Distances between a measured cloud and a shape of the component.
#pragma once

#include "precompute/registration/surface_tree.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

class CloudComparison {
 public:
  static constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  /// Points farther than `reach` are not of the component. positions: nodes x 3, finite.
  CloudComparison(std::span<const Point> points, std::span<const float> positions,
                  std::span<const std::array<std::uint32_t, 4>> elements, double reach);
  /// Of each point from the surface, length unit; NaN: beyond the reach.
  [[nodiscard]] std::span<const float> point_distances() const noexcept { return point_distances_; }
  /// Mean over the points that are nearest to an element; NaN: none is.
  [[nodiscard]] std::span<const float> element_distances() const noexcept { return element_distances_; }
  /// Points per element.
  [[nodiscard]] std::span<const std::uint32_t> element_points() const noexcept { return element_points_; }
  [[nodiscard]] std::size_t compared() const noexcept { return sorted_.size(); }
  /// Mean over the compared points; NaN without any.
  [[nodiscard]] double mean() const noexcept;
  /// The distance below which this share of the compared points is; NaN without any.
  [[nodiscard]] double quantile(double share) const noexcept;

 private:
  std::vector<float> point_distances_, element_distances_, sorted_;
  std::vector<std::uint32_t> element_points_;
};

}  // namespace lbea::tool
