// Places of nodes whose elements have all eroded: the surface continued across the hole.
#pragma once

#include "precompute/survey/common_mesh.hpp"

#include <memory>

namespace lbea::bake {
/// A free node says nothing about the surface, see free_nodes(). Its displacement from the undeformed mesh becomes the
/// mean of its neighbors' in the common mesh, the discrete harmonic extension from the nodes around the hole: smooth,
/// of one state alone, and in each coordinate between theirs (maximum principle). Where no living node is connected, it
/// is the mean displacement of all living nodes. Nodes that the common mesh lacks stay as they are.
class SurfaceContinuation {
 public:
  /// Keeps references to the run's mesh and the common one. reference: the reference run's mesh, which has the
  /// undeformed places of nodes that the run does not have; nullptr, or where it has none either: those places continue
  /// the ones around them.
  SurfaceContinuation(const SimulationMesh& mesh, const CommonMesh& common, MeshMapping mapping,
                      const SimulationMesh* reference = nullptr);
  ~SurfaceContinuation();
  SurfaceContinuation(SurfaceContinuation&&) = delete;
  SurfaceContinuation& operator=(SurfaceContinuation&&) = delete;

  /// Replaces the positions of such nodes. Does nothing without eroded elements, when the mesh is_continued, or when
  /// the state does not fit the mesh.
  void apply(SimulationState& state);

 private:
  class Hole;
  void find_places(const SimulationMesh* reference);
  [[nodiscard]] std::vector<float> of_common(const std::vector<float>& positions) const;
  [[nodiscard]] std::vector<std::uint8_t> of_common(const std::vector<std::uint8_t>& nodes) const;

  const SimulationMesh& mesh_;
  const CommonMesh& common_;
  MeshMapping mapping_;
  std::vector<float> places_;        // N x 3, undeformed
  std::vector<std::uint8_t> alive_;  // of the run's elements, for which hole_ was made
  std::unique_ptr<const Hole> hole_;
};
}  // namespace lbea::bake
