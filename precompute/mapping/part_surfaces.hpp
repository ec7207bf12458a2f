// The undeformed surface of a run, one tree of triangles per part.
#pragma once

#include "precompute/ensemble.hpp"
#include "precompute/registration/surface_tree.hpp"

#include <map>

namespace lbea::bake {
/// A place to look for: in one of these parts, with one of these normals (no normals: any). Parts and normals are the
/// reference run's.
struct WantedPlace {
  std::array<double, 3> point{};
  std::span<const std::uint32_t> parts{};
  std::span<const std::array<double, 3>> normals{};
};

class PartSurfaces {
 public:
  /// Part ids become those of `reference` by the table in `settings`. Parts are not told apart when one of the meshes
  /// has only one or when they have none in common. Throws Error{bad_input} when the run has no surface.
  PartSurfaces(const SimulationMesh& reference, const SimulationMesh& run, const MappingSettings& settings);

  /// The nearest place in one of the parts whose normal, in either direction, is within 60 degrees of one of the
  /// normals. Ties go to the first part.
  [[nodiscard]] SurfacePlace nearest(const WantedPlace& wanted,
                                     double reach = std::numeric_limits<double>::infinity()) const;
  [[nodiscard]] bool tells_parts() const noexcept { return tells_parts_; }

 private:
  bool tells_parts_;
  std::map<std::uint32_t, SurfaceTree> trees_;  // by part id in the reference run; one tree when parts do not count
};
}  // namespace lbea::bake
