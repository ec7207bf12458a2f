// Deformation branches: simulations whose last states look alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace lbea::bake {

/// Every k-th of rows of `components` values, of at most `most`: enough to compare shapes or fields.
[[nodiscard]] std::vector<float> thinned_rows(std::span<const float> values, std::size_t components, std::size_t most);
/// The same of positions, nodes x 3.
[[nodiscard]] inline std::vector<float> thinned_nodes(std::span<const float> positions, std::size_t most) {
  return thinned_rows(positions, 3, most);
}

/// One branch number per simulation, counted from 0 in the order in which they first appear.
/// last_states: one row per simulation, of positions x 3, the same length each. Average linkage, cut into the
/// two to eight groups with the greatest mean silhouette; when even that is not clear, all simulations are one branch.
[[nodiscard]] std::vector<std::uint32_t> deformation_branches(std::span<const std::vector<float>> last_states);

/// The same, rows read one by one, each at most twice. Of more than `most_grouped` simulations every k-th is
/// grouped and the others join the group they are nearest to, on the average: the work grows with their number, the
/// memory does not.
[[nodiscard]] std::vector<std::uint32_t> deformation_branches(
    std::size_t simulations, const std::function<std::vector<float>(std::size_t simulation)>& last_state,
    std::size_t most_grouped = 256);

}  // namespace lbea::bake
