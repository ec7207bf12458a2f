// The mesh of the reference run on the undeformed surface of a run with another mesh.
#pragma once

#include "precompute/ensemble.hpp"
#include "precompute/registration/surface_tree.hpp"

#include <span>

namespace lbea::bake {
/// A node of the reference mesh on a triangle of the run's surface, which carries it.
struct CarriedNode {
  std::array<std::uint32_t, 3> nodes{};  // of the run
  std::array<double, 3> shares{};        // barycentric
  std::uint32_t element = 0;             // of the run
};

struct SurfaceMapping {
  SimulationMesh mesh;                                // what the run has of the reference mesh, on its surface
  std::vector<CarriedNode> nodes;                     // per node of the mesh
  std::vector<std::array<std::uint32_t, 4>> sources;  // per element of the mesh: the run's elements at its quarters
  MappingReport report;
};

/// Where the nodes of the reference mesh are on the run's surface: after the smooth difference of the shapes, the
/// nearest places among the candidates of PartSurfaces. Nodes that no outer element has, and those without a candidate,
/// have none.
[[nodiscard]] std::vector<SurfacePlace> places_of_nodes(const SimulationMesh& reference, const SimulationMesh& run,
                                                        const MappingSettings& settings);

/// The positions of carried nodes, from those of the run's nodes x 3. A node with the share 1 is copied bit for bit.
void carry(std::span<const CarriedNode> nodes, std::span<const float> run, std::vector<float>& into);

/// Every node goes to its place, see places_of_nodes(). Elements are left out when one of their nodes or quarters is
/// farther than the settings' distance. Where the run has a node at a place, the reference's node is that node.
/// unit: of lengths. Throws Error{bad_input} with the figures when the run has too little of the mesh.
[[nodiscard]] SurfaceMapping map_surface(const SimulationMesh& reference, const SimulationMesh& run,
                                         const MappingSettings& settings, const std::string& unit);
}  // namespace lbea::bake
