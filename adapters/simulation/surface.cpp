#include "adapters/simulation/surface.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

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

SolidFaces solid_faces(std::span<const Hexahedron> solids) {
  std::vector<SurfaceElement> faces;
  faces.reserve(solids.size() * hexahedron_faces.size());
  for (std::uint32_t s = 0; s < solids.size(); ++s) {
    if (const auto corners = tetrahedron(solids[s]))
      add_faces(tetrahedron_faces, *corners, s, faces);
    else
      add_faces(hexahedron_faces, solids[s], s, faces);
  }
  std::vector<std::pair<Quad, std::uint32_t>> keys(faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) keys[f] = {face_key(faces[f].nodes), f};
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> outer;
  SolidFaces result;
  for (std::size_t first = 0, last = 0; first < keys.size(); first = last) {
    while (last < keys.size() && keys[last].first == keys[first].first) ++last;
    if (last - first == 1) outer.push_back(keys[first].second);
    if (last - first == 2)
      for (std::size_t k = first; k < last; ++k) result.touching.push_back(faces[keys[k].second]);
  }
  std::sort(outer.begin(), outer.end());
  for (const std::uint32_t f : outer) result.outer.push_back(faces[f]);
  return result;
}
}  // namespace lbea::io
