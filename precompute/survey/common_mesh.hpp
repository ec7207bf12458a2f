// Method step 2: the nodes and elements common to all samples, by the solver's numbering.
#pragma once

#include "precompute/simulation.hpp"

#include <span>

namespace lbea::bake {
/// The nodes and elements that every run has, in the order of the reference run. An element is on the surface in some
/// sample, but not always in all.
struct CommonMesh {
  std::vector<std::uint32_t> node_ids;       // N, the solver's numbering
  std::vector<Quad> elements;                // E, node indices
  std::vector<std::uint32_t> element_ids;    // E
  std::vector<std::uint32_t> element_parts;  // E
};

/// What the reference run's surface has and the common mesh lacks, and why.
struct MeshLosses {
  std::uint32_t elements = 0, nodes = 0;  // of the reference run's surface
  std::uint32_t eroded = 0, missing = 0;  // elements left out: eroded in all samples; not in all runs
  std::uint32_t eroding = 0;              // elements kept that are eroded in some samples
  std::uint32_t nodes_left_out = 0;
  std::uint32_t exposed = 0;      // elements added: faces of solids whose neighbors erode in some sample
  std::vector<std::string> runs;  // where elements erode
};

/// In how many used states a run has an element on its surface, see exposed_elements().
enum class Presence : std::uint8_t { missing, always, sometimes, never };

/// Collects the presence of a run's elements, state by state.
class PresenceInStates {
 public:
  explicit PresenceInStates(std::size_t elements) : seen_(elements), lacked_(elements) {}
  /// surface: per element 1 or 0.
  void add(std::span<const std::uint8_t> surface);
  [[nodiscard]] std::vector<Presence> presence() const;

 private:
  std::vector<std::uint8_t> seen_, lacked_;
};

/// Indices of the common mesh's nodes and elements in a run.
struct MeshMapping {
  std::vector<std::uint32_t> nodes;     // N
  std::vector<std::uint32_t> elements;  // E
};

/// Throws Error{bad_input} naming `run` when sizes or node indices of its mesh are inconsistent.
void check_mesh(const SimulationMesh& mesh, const std::string& run);

/// Whether two checked meshes have the same numbers: at least nine tenths of the smaller one's elements have the same
/// element id and node ids in the other and, in the mean within a tenth, edges of the same length. Their places do not
/// count.
[[nodiscard]] bool has_numbers_of(const SimulationMesh& reference, const SimulationMesh& mesh);

/// The presence of the elements of `reference` in a run. present: of the run's elements.
/// Throws Error{bad_input} naming `run` when its mesh is inconsistent.
[[nodiscard]] std::vector<Presence> common_elements(const SimulationMesh& reference, const SimulationMesh& mesh,
                                                    std::span<const Presence> present, const std::string& run);

/// Reduces the reference run's mesh to what all runs have and some sample shows; the order of the runs does not matter.
/// Two elements are the same when their ids and the ids of their nodes are equal. Errors name `run`.
class CommonMeshBuilder {
 public:
  /// Throws Error{bad_input} when node ids repeat.
  CommonMeshBuilder(SimulationMesh reference, const std::string& run);
  /// common: as common_elements() returns it.
  void keep(std::span<const Presence> common, const std::string& run);
  /// Throws Error{bad_input} when nothing is common. Nodes without a common element are left out.
  [[nodiscard]] CommonMesh finish() const;
  [[nodiscard]] MeshLosses losses() const;
  /// Per kept run, in the order of keep(): whether some sample of it lacks an element of the common mesh.
  [[nodiscard]] std::vector<std::uint8_t> lack_elements() const;
  [[nodiscard]] const SimulationMesh& reference() const noexcept { return reference_; }

 private:
  /// Of an element of a run: outer elements are mostly always present, faces between two solids never.
  struct Unusual {
    std::uint32_t element = 0;
    Presence presence{};
  };
  [[nodiscard]] Presence usual(std::size_t element) const noexcept {
    return element + reference_.touching < reference_.elements.size() ? Presence::always : Presence::never;
  }
  [[nodiscard]] std::vector<std::uint8_t> kept() const;  // per element of the reference

  SimulationMesh reference_;
  std::vector<Presence> presence_;             // of its elements in all samples; missing: in some run
  std::vector<std::vector<Unusual>> unusual_;  // per run
  std::vector<std::string> eroding_runs_;
};

/// Throws Error{bad_input} when the mesh lacks a node or an element of `common`.
[[nodiscard]] MeshMapping map_common(const CommonMesh& common, const SimulationMesh& mesh, const std::string& run);
}  // namespace lbea::bake
