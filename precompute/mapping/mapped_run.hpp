// Runs with other meshes, presented on the mesh of the reference run: everything after this sees one mesh.
#pragma once

#include "precompute/mapping/surface_mapping.hpp"

#include <mutex>

namespace lbea::bake {
/// Opens runs for a bake. Safe from several threads.
class RunMapper {
 public:
  using Opener = std::function<std::unique_ptr<SimulationReader>()>;

  RunMapper(Opener reference, MappingSettings settings, std::string unit);

  /// The run itself when it has the reference run's numbers (has_numbers_of()) or mapping is disabled; else a reader of
  /// the same states on the reference run's mesh. A node follows its place on the run's surface; an element has the
  /// mean of the fields at its quarters, and is eroded when one of the elements that carry it is.
  /// Throws Error{bad_input} naming `run`.
  [[nodiscard]] std::unique_ptr<SimulationReader> mapped(std::unique_ptr<SimulationReader> reader,
                                                         const std::string& run);

 private:
  using Mapping = std::shared_ptr<const SurfaceMapping>;
  const SimulationMesh& reference();
  [[nodiscard]] Mapping mapping_of(const SimulationMesh& run);

  Opener open_reference_;
  MappingSettings settings_;
  std::string unit_;
  std::mutex mutex_;  // of the next two
  std::optional<SimulationMesh> reference_;
  std::vector<std::pair<std::uint64_t, Mapping>> latest_;  // by a hash of the run's mesh
};

/// Lets the runs open through a RunMapper and, if the description says so, in the BodyFrame of its nodes.
/// is_mapped: per run; the others are not mapped.
void map_runs(Ensemble& ensemble, const EnsembleDescription& description, const std::vector<bool>& is_mapped);
}  // namespace lbea::bake
