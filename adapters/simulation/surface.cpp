#include "adapters/simulation/surface.hpp"

#include <algorithm>
#include <limits>
#include <optional>

namespace lbea::io {
namespace {

// Corners of a hexahedron's and a tetrahedron's faces, counter-clockwise seen from outside.
constexpr std::array<std::array<std::uint8_t, 4>, 6> hexahedron_faces{
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
constexpr std::array<std::array<std::uint8_t, 4>, 4> tetrahedron_faces{
    {{0, 2, 1, 1}, {0, 1, 3, 3}, {1, 2, 3, 3}, {2, 0, 3, 3}}};

/// The quad without repeated neighbors: four corners, or three with the last repeated, or nothing.
std::optional<Quad> normalized(const Quad& quad) {
  Quad kept{};
  std::size_t corners = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (quad[i] != quad[(i + 1) % 4]) kept[corners++] = quad[i];
  if (corners < 3) return std::nullopt;
  if (corners == 3) kept[3] = kept[2];
  // two opposite corners at one node: no area
  if (corners == 4 && (kept[0] == kept[2] || kept[1] == kept[3])) return std::nullopt;
  return kept;
}

/// Four distinct nodes in the order of their first appearance, when there are exactly four.
std::optional<Quad> tetrahedron(const Hexahedron& solid) {
  Quad distinct{};
  std::size_t count = 0;
  for (const std::uint32_t node : solid) {
    if (std::find(distinct.begin(), distinct.begin() + static_cast<std::ptrdiff_t>(count), node) !=
        distinct.begin() + static_cast<std::ptrdiff_t>(count))
      continue;
    if (count == 4) return std::nullopt;
    distinct[count++] = node;
  }
  if (count < 4) return std::nullopt;
  return distinct;
}

template <typename Faces, typename Corners>
void add_faces(const Faces& faces, const Corners& corners, std::uint32_t source, std::vector<SurfaceElement>& into) {
  for (const auto& face : faces)
    if (const auto quad = normalized({corners[face[0]], corners[face[1]], corners[face[2]], corners[face[3]]}))
      into.push_back({*quad, source});
}

/// The same for every order of a face's nodes.
Quad face_key(Quad nodes) {
  if (nodes[2] == nodes[3]) nodes[3] = std::numeric_limits<std::uint32_t>::max();
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

}  // namespace

std::vector<SurfaceElement> shell_faces(std::span<const Quad> shells) {
  std::vector<SurfaceElement> faces;
  faces.reserve(shells.size());
  for (std::uint32_t s = 0; s < shells.size(); ++s)
    if (const auto quad = normalized(shells[s])) faces.push_back({*quad, s});
  return faces;
}

std::vector<SurfaceElement> outer_faces(std::span<const Hexahedron> solids) {
  std::vector<SurfaceElement> faces;
  faces.reserve(solids.size() * hexahedron_faces.size());
  for (std::uint32_t s = 0; s < solids.size(); ++s) {
    if (const auto corners = tetrahedron(solids[s]))
      add_faces(tetrahedron_faces, *corners, s, faces);
    else
      add_faces(hexahedron_faces, solids[s], s, faces);
  }
  std::vector<Quad> keys(faces.size());
  std::transform(faces.begin(), faces.end(), keys.begin(), [](const SurfaceElement& f) { return face_key(f.nodes); });
  std::sort(keys.begin(), keys.end());
  std::erase_if(faces, [&](const SurfaceElement& face) {
    const auto [first, last] = std::equal_range(keys.begin(), keys.end(), face_key(face.nodes));
    return last - first > 1;
  });
  return faces;
}

}  // namespace lbea::io
