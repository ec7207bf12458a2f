// Method step 2: the nodes and elements common to all samples, by the solver's numbering.
#pragma once

#include "precompute/simulation.hpp"
#include "precompute/survey/quad.hpp"

#include <span>
#include <string>
#include <vector>

namespace lbea::bake {

/// The whole component as every sample has it. Order as in the reference run.
struct CommonMesh {
  std::vector<std::uint32_t> node_ids;       // N, the solver's numbering
  std::vector<Quad> elements;                // E, node indices
  std::vector<std::uint32_t> element_ids;    // E
  std::vector<std::uint32_t> element_parts;  // E
};

/// Where a run keeps the nodes and elements of the common mesh.
struct MeshMapping {
  std::vector<std::uint32_t> nodes;     // N: index in the run
  std::vector<std::uint32_t> elements;  // E: index in the run
};

/// Which elements of `reference` a run has and keeps: one flag each. alive: the run's elements, 0 when eroded in any
/// used state. Throws Error{bad_input} naming `run` when its mesh is not one.
[[nodiscard]] std::vector<std::uint8_t> common_elements(const SimulationMesh& reference, const SimulationMesh& mesh,
                                                        std::span<const std::uint8_t> alive, const std::string& run);

/// Narrows the reference run's mesh down, run by run; the order of the runs does not matter.
/// An element is the same when its id and the ids of its nodes are. Errors name `run`.
class CommonMeshBuilder {
 public:
  /// Throws Error{bad_input} when node ids repeat.
  CommonMeshBuilder(SimulationMesh reference, const std::string& run);
  /// `alive`: the run's elements, 0 when eroded in any used state.
  void keep_common(const SimulationMesh& mesh, std::span<const std::uint8_t> alive, const std::string& run);
  /// What common_elements() said of a run.
  void keep(std::span<const std::uint8_t> common);
  /// Throws Error{bad_input} when nothing is common. Nodes without a common element are left out.
  [[nodiscard]] CommonMesh finish() const;
  [[nodiscard]] const SimulationMesh& reference() const noexcept { return reference_; }

 private:
  SimulationMesh reference_;
  std::vector<std::uint8_t> kept_;  // reference_.elements
};

/// Throws Error{bad_input} when the mesh lacks a node or an element of `common`.
[[nodiscard]] MeshMapping map_common(const CommonMesh& common, const SimulationMesh& mesh, const std::string& run);

}  // namespace lbea::bake
