// Method step 2: the reference meshes, and the region of them that the rig can see.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/survey/common_mesh.hpp"

namespace lbea::bake {
/// A node is chosen when it meets every given criterion, an element when its part and all its nodes are chosen.
struct RegionCriteria {
  std::vector<std::uint32_t> parts;        // empty: any
  std::optional<Box> box;                  // of `positions`
  std::vector<std::uint32_t> node_ids;     // empty: any
  std::vector<std::uint8_t> visible;       // N, 0 = hidden from the rig; empty: all visible
  std::vector<std::uint8_t> present = {};  // E, 0 = not on the surface in a reference mesh; empty: all are
};

struct ObservedRegion {
  std::vector<std::uint32_t> nodes;  // n, ascending node indices of the common mesh; only those that elements use
  std::vector<Quad> elements;        // indices into `nodes`
  std::size_t without_area = 0;      // elements left out because their nodes would have no area around them
};

/// positions: N x 3 of the common mesh at impact. `all_node_ids`: of the reference run, also those not common.
/// Throws Error{bad_config} naming a part or node id that does not exist, and when nothing is left.
[[nodiscard]] ObservedRegion observed_region(const CommonMesh& mesh, std::span<const float> positions,
                                             const RegionCriteria& criteria,
                                             std::span<const std::uint32_t> all_node_ids);

/// The reference run at one of its states, on the common mesh.
struct ReferenceState {
  double time_s = 0;                       // since impact
  std::vector<float> positions;            // N x 3
  std::vector<std::uint8_t> present = {};  // E, 0 = not on the surface
};

struct Reference {
  ObservedRegion region;
  std::vector<ReferenceState> states;  // sim_ref: (a) at impact, or (b) over time
};

struct BakePlan;

/// plan: after the survey. Throws Error{bad_config | bad_input}.
[[nodiscard]] Reference choose_reference(const BakePlan& plan, const BakeOptions& options);
}  // namespace lbea::bake
