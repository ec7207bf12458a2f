// Method step 2: the nodes and elements common to all samples, by the solver's numbering.
#pragma once

#include "precompute/simulation.hpp"

#include <span>

namespace lbea::bake {

/// The nodes and elements that every sample has, in the order of the reference run.
struct CommonMesh {
  std::vector<std::uint32_t> node_ids;       // N, the solver's numbering
  std::vector<Quad> elements;                // E, node indices
  std::vector<std::uint32_t> element_ids;    // E
  std::vector<std::uint32_t> element_parts;  // E
};

/// Indices of the common mesh's nodes and elements in a run.
struct MeshMapping {
  std::vector<std::uint32_t> nodes;     // N
  std::vector<std::uint32_t> elements;  // E
};

/// Which elements of `reference` a run has and keeps: one flag each. alive: the run's elements, 0 when eroded in any
/// used state. Throws Error{bad_input} naming `run` when its mesh is inconsistent.
[[nodiscard]] std::vector<std::uint8_t> common_elements(const SimulationMesh& reference, const SimulationMesh& mesh,
                                                        std::span<const std::uint8_t> alive, const std::string& run);

/// Reduces the reference run's mesh to what all runs have; the order of the runs does not matter.
/// Two elements are the same when their ids and the ids of their nodes are equal. Errors name `run`.
class CommonMeshBuilder {
 public:
  /// Throws Error{bad_input} when node ids repeat.
  CommonMeshBuilder(SimulationMesh reference, const std::string& run);
  /// common: as common_elements() returns it.
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
