// The surface of a finite-element model: its shells and the outer faces of its solids.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::io {
using Quad = std::array<std::uint32_t, 4>;  // a triangle repeats its last node
using Hexahedron = std::array<std::uint32_t, 8>;

struct SurfaceElement {
  Quad nodes;
  std::uint32_t source;  // index of the shell or solid it comes from
};

/// Shells in file order, without those that repeated nodes leave with fewer than three corners.
[[nodiscard]] std::vector<SurfaceElement> shell_faces(std::span<const Quad> shells);

struct SolidFaces {
  std::vector<SurfaceElement> outer;     // belong to exactly one solid, by solid
  std::vector<SurfaceElement> touching;  // belong to exactly two solids: pairs of the first one's and the second one's
};

/// The faces of solids, with outward normals when nodes are in LS-DYNA's order.
/// Wedges, pyramids and tetrahedra are hexahedra with repeated nodes; faces without area are left out.
[[nodiscard]] SolidFaces solid_faces(std::span<const Hexahedron> solids);
}  // namespace lbea::io
