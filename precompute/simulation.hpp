// A finite-element run as the bake reads it: one surface mesh and many states, one at a time.
// The readers of the file formats are in adapters/simulation.
#pragma once

#include "runtime/src/channels/solver_history.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lbea::bake {
/// A surface element by its nodes: a quad, split along its nodes 0-2; a triangle repeats its last node.
using Quad = std::array<std::uint32_t, 4>;

/// The undeformed surface: shells and the outer faces of solids, as quads.
struct SimulationMesh {
  std::vector<float> positions;              // nodes x 3, length unit
  std::vector<std::uint32_t> node_ids;       // nodes, the solver's numbering
  std::vector<Quad> elements;                // node indices
  std::vector<std::uint32_t> element_ids;    // elements, the solver's numbering (a solid's faces share its id)
  std::vector<std::uint32_t> element_parts;  // elements, part ids
  /// How many of the last elements are pairs of faces by which two solids touch. A face of a pair belongs to the
  /// surface when the solid of the other one has eroded.
  std::size_t touching = 0;
  bool has_solver_ids = true;  // false: the file has no node ids, they count its nodes
  bool is_continued = false;   // the states have no free nodes: SurfaceContinuation was applied to them before
  /// nodes; 1: without an undeformed position in the files, `positions` has one by its neighbors. Empty: all have one.
  std::vector<std::uint8_t> guessed = {};

  [[nodiscard]] std::size_t nodes() const noexcept { return node_ids.size(); }
};

/// Which elements are part of the surface: those that are alive and, if touching, not covered by a living solid.
[[nodiscard]] inline std::vector<std::uint8_t> exposed_elements(const SimulationMesh& mesh,
                                                                std::vector<std::uint8_t> alive) {
  for (std::size_t e = alive.size() - mesh.touching; e + 1 < alive.size(); e += 2) {
    const bool first = alive[e] != 0, second = alive[e + 1] != 0;
    alive[e] = first && !second ? 1 : 0;
    alive[e + 1] = second && !first ? 1 : 0;
  }
  return alive;
}

/// Per node 1 when all elements that use it have eroded: it flies freely, and its position may be any number, or none.
/// No node is free when alive does not fit the mesh.
[[nodiscard]] inline std::vector<std::uint8_t> free_nodes(const SimulationMesh& mesh,
                                                          const std::vector<std::uint8_t>& alive) {
  std::vector<std::uint8_t> is_free(mesh.nodes());
  if (alive.size() != mesh.elements.size() || std::ranges::find(alive, 0) == alive.end()) return is_free;
  for (const bool lives : {false, true})
    for (std::size_t e = 0; e < alive.size(); ++e)
      if ((alive[e] != 0) == lives)
        for (const std::uint32_t node : mesh.elements[e]) is_free[node] = lives ? 0 : 1;
  return is_free;
}

/// A quantity per element that the run's states carry.
struct SimulationField {
  std::string name;         // e.g. "plastic_strain"
  std::string unit;         // "1" for pure numbers, empty when the file does not say
  std::string source = {};  // how the values come from the file: "largest of the integration points", "array stress"
};

/// Numbers that the run's states carry besides the mesh: one of the whole run, or one per part or rigid wall.
struct SimulationHistory {
  std::string name;  // e.g. "internal_energy", "part_mass"
  HistoryOwner owner = HistoryOwner::run;
  std::vector<std::uint32_t> ids = {};  // of the parts or walls

  [[nodiscard]] std::size_t size() const noexcept { return owner == HistoryOwner::run ? 1 : ids.size(); }
};

/// A history at the solver's own times, which ascend.
struct HistorySeries {
  std::vector<double> times, values;  // of equal size, in the solver's units

  /// Whether the solver wrote it until a time: a state may be one interval before the first or after the last one.
  [[nodiscard]] bool covers(double time) const noexcept {
    if (times.size() < 2) return !times.empty() && time == times.front();
    return time >= times.front() - (times[1] - times[0]) &&
           time <= times.back() + (times.back() - times[times.size() - 2]);
  }
  /// Linear between the times; before the first and after the last one as there. There must be one.
  [[nodiscard]] double at(double time) const noexcept {
    const auto next = std::ranges::lower_bound(times, time);
    const auto place = static_cast<std::size_t>(next - times.begin());
    if (next == times.end()) return values.back();
    if (next == times.begin() || *next == time) return values[place];
    const double share = (time - times[place - 1]) / (*next - times[place - 1]);
    return values[place - 1] + share * (values[place] - values[place - 1]);
  }
};

/// One stored state. Buffers are reused from read to read.
struct SimulationState {
  double time_s = 0;
  std::vector<float> positions;            // nodes x 3, current positions (not displacements)
  std::vector<std::uint8_t> alive;         // elements, 0 = eroded
  std::vector<std::vector<float>> fields;  // [field][element], in the order of SimulationReader::fields()
};

/// How the mesh of a run was mapped onto the reference run's. Lengths in the length unit, undeformed.
struct MappingReport {
  std::uint32_t run_elements = 0;                   // of the run's surface
  std::uint32_t elements = 0, mapped_elements = 0;  // of the reference run's surface
  double mean = 0, largest = 0;                     // distance of the mapped nodes from the run's surface
  std::uint32_t worst_element = 0;                  // id of the reference run's element at the largest distance
  double shift = 0;                                 // largest smooth difference of the shapes, allowed for before
  bool tells_parts = true;                          // false: parts were not compared
  std::uint64_t key = 0;                            // hash of the mapping
};

/// Reads one run with bounded memory: the mesh and one state.
/// Errors are lbea::Error with a sentence that names file, byte and what to do.
class SimulationReader {
 public:
  virtual ~SimulationReader() = default;
  [[nodiscard]] virtual const SimulationMesh& mesh() const noexcept = 0;
  [[nodiscard]] virtual const std::vector<SimulationField>& fields() const noexcept = 0;
  [[nodiscard]] virtual std::uint32_t states() const noexcept = 0;
  [[nodiscard]] virtual double time_s(std::uint32_t state) const = 0;
  virtual void read(std::uint32_t state, SimulationState& into) = 0;
  [[nodiscard]] virtual std::vector<SimulationHistory> histories() { return {}; }
  /// place: among all numbers of histories(), in their order. In the solver's unit.
  [[nodiscard]] virtual double history(std::uint32_t /*state*/, std::uint32_t /*place*/) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  /// The same at all times at which the solver wrote it; empty: at those of the states.
  [[nodiscard]] virtual HistorySeries history_series(std::uint32_t /*place*/) { return {}; }
  /// The files the run consists of, in reading order. No other run has one of them.
  [[nodiscard]] virtual std::vector<std::filesystem::path> files() const = 0;
  /// Further files that those name as parts of themselves; other runs may do so, too.
  [[nodiscard]] virtual std::vector<std::filesystem::path> named_files() const { return {}; }
  /// What a user should know of the files although they can be read, as a sentence; mostly empty.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  /// Set when mesh and states are not the run's own but mapped onto the reference run's.
  [[nodiscard]] virtual std::optional<MappingReport> mapping() const { return {}; }
};

/// Presents another run. What derived classes do not override is that of the other run.
class DerivedRun : public SimulationReader {
 public:
  explicit DerivedRun(std::unique_ptr<SimulationReader> run) : run_(std::move(run)) {}

  [[nodiscard]] const SimulationMesh& mesh() const noexcept override { return run_->mesh(); }
  [[nodiscard]] const std::vector<SimulationField>& fields() const noexcept override { return run_->fields(); }
  [[nodiscard]] std::uint32_t states() const noexcept override { return run_->states(); }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return run_->time_s(state); }
  void read(std::uint32_t state, SimulationState& into) override { run_->read(state, into); }
  [[nodiscard]] std::vector<SimulationHistory> histories() override { return run_->histories(); }
  [[nodiscard]] double history(std::uint32_t state, std::uint32_t place) override {
    return run_->history(state, place);
  }
  [[nodiscard]] HistorySeries history_series(std::uint32_t place) override { return run_->history_series(place); }
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return run_->files(); }
  [[nodiscard]] std::vector<std::filesystem::path> named_files() const override { return run_->named_files(); }
  [[nodiscard]] std::string remark() const override { return run_->remark(); }
  [[nodiscard]] std::optional<MappingReport> mapping() const override { return run_->mapping(); }

 protected:
  std::unique_ptr<SimulationReader> run_;
};

/// All files that a run is read from: hashed into the model's provenance, and watched for changes.
[[nodiscard]] inline std::vector<std::filesystem::path> all_files(const SimulationReader& run) {
  std::vector<std::filesystem::path> files = run.files();
  const std::vector<std::filesystem::path> named = run.named_files();
  files.insert(files.end(), named.begin(), named.end());
  return files;
}
}  // namespace lbea::bake
