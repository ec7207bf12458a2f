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

/// Shells in file order; a shell that repeated nodes leave with fewer than three corners is left out.
[[nodiscard]] std::vector<SurfaceElement> shell_faces(std::span<const Quad> shells);

/// The faces that belong to exactly one solid, by solid, with outward normals for solids numbered as LS-DYNA numbers
/// them. Wedges, pyramids and tetrahedra are hexahedra with repeated nodes; faces that vanish are left out.
[[nodiscard]] std::vector<SurfaceElement> outer_faces(std::span<const Hexahedron> solids);

}  // namespace lbea::io
