// The points of a frame that are near no simulation of any of several components: a part of one that has left the space
// of its simulations is not that of another one.
#pragma once

#include "runtime/src/match/cloud_index.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

class PointsNearNone {
 public:
  /// For frames of up to config.max_points points, from its pose.
  PointsNearNone(const std::vector<Model>& components, const MatcherConfig& config);
  /// Marks the points near simulations of this component. Threads with different components may call it side by side.
  void mark(std::size_t component, std::span<const Point> points) noexcept;
  /// How many points of the frame that was marked for all components are near none; 0 of one with too many points.
  [[nodiscard]] std::uint32_t count(std::span<const Point> points) const noexcept;

 private:
  RigidTransform T_reference_sensor_;
  std::vector<CellGrid> envelopes_;
  std::vector<std::vector<std::uint8_t>> is_near_;  // of each component, for each point
};

}  // namespace lbea::tool
