// Method step 3: for every vertex of the reference mesh, the nearest point of the cloud.
#pragma once

#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/positions.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace lbea {

/// corresponding[v] = position of the indexed point nearest to vertices[v]; exact, ties to the lower place in the
/// frame. Fast when vertices near each other in number are near in space, and when `corresponding` comes with a guess:
/// the answers for the frame before, say. The answer does not depend on it.
/// `points`, when not empty, receives the places in the frame. The index must hold at least one point.
void correspond(const CloudIndex& index, std::span<const std::array<float, 3>> vertices, Positions& corresponding,
                std::span<std::uint32_t> points = {}) noexcept;

/// The share of the surface that the frame shows: the mass of the vertices (placed at `positions`) with a point
/// within `trusted_distance`, over the mass of all.
[[nodiscard]] float coverage(const CloudIndex& index, std::span<const std::array<float, 3>> positions,
                             std::span<const double> mass, float trusted_distance) noexcept;

}  // namespace lbea
