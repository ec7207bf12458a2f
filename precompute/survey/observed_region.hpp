// Method step 2: the part of the reference mesh that the rig can see, whose vertices the basis lives on.
#pragma once

#include "precompute/ensemble_description.hpp"
#include "precompute/survey/common_mesh.hpp"

#include <optional>
#include <span>
#include <vector>

namespace lbea::bake {

/// A node is in when it meets every criterion given, an element when its part and all its nodes are in.
struct RegionCriteria {
  std::vector<std::uint32_t> parts;     // empty: any
  std::optional<Box> box;               // of `positions`
  std::vector<std::uint32_t> node_ids;  // empty: any
  std::vector<std::uint8_t> visible;    // N, 0 = hidden from the rig; empty: all visible
};

struct ObservedRegion {
  std::vector<std::uint32_t> nodes;  // n, ascending node indices of the common mesh; only those that elements use
  std::vector<Quad> elements;        // indices into `nodes`
};

/// positions: N x 3 of the common mesh at impact. `all_node_ids`: of the reference run, also those not common.
/// Throws Error{bad_config} naming a part or node id that does not exist, and when nothing is left.
[[nodiscard]] ObservedRegion observed_region(const CommonMesh& mesh, std::span<const float> positions,
                                             const RegionCriteria& criteria,
                                             std::span<const std::uint32_t> all_node_ids);

}  // namespace lbea::bake
