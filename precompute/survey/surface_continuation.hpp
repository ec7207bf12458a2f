// Places of nodes whose elements have all eroded: the surface continued across the hole.
#pragma once

#include "precompute/simulation.hpp"

#include <memory>

namespace lbea::bake {
/// A node without a living element flies freely, and says nothing about the surface. Its displacement from the
/// undeformed mesh becomes the mean of its neighbors' in the mesh, the discrete harmonic extension from the nodes
/// around the hole: smooth, of one state alone, and in each coordinate between theirs (maximum principle). Where no
/// living node is connected, it is the mean displacement of all living nodes.
class SurfaceContinuation {
 public:
  /// Keeps a reference to the mesh.
  explicit SurfaceContinuation(const SimulationMesh& mesh);
  ~SurfaceContinuation();
  SurfaceContinuation(SurfaceContinuation&&) = delete;
  SurfaceContinuation& operator=(SurfaceContinuation&&) = delete;

  /// Replaces the positions of such nodes. Does nothing without eroded elements, when the mesh is_continued, or when
  /// the state does not fit the mesh.
  void apply(SimulationState& state);

 private:
  class Hole;
  const SimulationMesh& mesh_;
  std::vector<std::uint8_t> alive_;  // of the elements, for which hole_ was made
  std::unique_ptr<const Hole> hole_;
};
}  // namespace lbea::bake
