// Deformation branches: simulations whose last states look alike.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

/// One branch number per simulation, counted from 0 in the order in which they first appear.
/// last_states: one row per simulation, of positions x 3, the same length each. Average linkage, cut into the
/// two to eight groups with the greatest mean silhouette; when even that is not clear, all simulations are one branch.
[[nodiscard]] std::vector<std::uint32_t> deformation_branches(std::span<const std::vector<float>> last_states);

}  // namespace lbea
