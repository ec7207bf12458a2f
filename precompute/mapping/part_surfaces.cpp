#include "precompute/mapping/part_surfaces.hpp"

#include <algorithm>
#include <set>

namespace lbea::bake {
namespace {
using PartIds = std::set<std::uint32_t>;

std::uint32_t in_reference(std::uint32_t part, const MappingSettings& settings) {
  const auto row = std::ranges::find(settings.parts, part, [](const auto& pair) { return pair[0]; });
  return row == settings.parts.end() ? part : (*row)[1];
}

/// 1 = an outer element that `is_chosen`.
std::vector<std::uint8_t> chosen(const SimulationMesh& mesh, const auto& is_chosen) {
  std::vector<std::uint8_t> kept(mesh.elements.size(), 0);
  for (std::size_t e = 0; e < mesh.elements.size() - mesh.touching; ++e) kept[e] = is_chosen(e) ? 1 : 0;
  return kept;
}
}  // namespace

PartSurfaces::PartSurfaces(const SimulationMesh& reference, const SimulationMesh& run,
                           const MappingSettings& settings) {
  const PartIds wanted(reference.element_parts.begin(), reference.element_parts.end());
  std::vector<std::uint32_t> parts;
  for (const std::uint32_t part : run.element_parts) parts.push_back(in_reference(part, settings));
  const PartIds present(parts.begin(), parts.end());
  tells_parts_ = settings.by_part && wanted.size() > 1 && present.size() > 1 &&
                 std::ranges::any_of(present, [&](std::uint32_t part) { return wanted.contains(part); });
  const auto add = [&](std::uint32_t part, const auto& is_chosen) {
    SurfaceTree tree(run.positions, run.elements, chosen(run, is_chosen));
    if (tree.triangles() > 0) trees_.emplace(part, std::move(tree));
  };
  if (!tells_parts_) add(0, [](std::size_t) { return true; });
  for (const std::uint32_t part : present)
    if (tells_parts_ && wanted.contains(part)) add(part, [&](std::size_t e) { return parts[e] == part; });
  if (trees_.empty())
    throw Error(Status::bad_input, "its mesh is another one and has no element with an area; leave the run out");
}

SurfacePlace PartSurfaces::nearest(const WantedPlace& wanted, double reach) const {
  constexpr double least_cosine = 0.5;
  constexpr std::array<std::uint32_t, 1> any{0};
  const std::span<const std::uint32_t> parts = tells_parts_ ? wanted.parts : any;
  SurfacePlace best;
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    const auto tree = trees_.find(*part);
    if (tree == trees_.end() || std::find(parts.begin(), part, *part) != part) continue;
    const SurfacePlace place =
        tree->second.nearest(wanted.point, std::min(reach, best.distance), {wanted.normals, least_cosine});
    if (place.found() && place.distance < best.distance) best = place;
  }
  return best;
}
}  // namespace lbea::bake
