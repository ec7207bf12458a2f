// What is baked: the runs of an ensemble, and what a bake makes of them, with every default.
// adapters/ensemble fills the description from a TOML file, tools/bake from flags.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

#include <functional>
#include <memory>
#include <optional>

namespace lbea::bake {
/// Which stored states of every run become samples.
struct StepSelection {
  std::uint32_t first = 0;
  std::uint32_t last = std::numeric_limits<std::uint32_t>::max();  // inclusive; beyond the run's end: its last state
  std::uint32_t stride = 1;
  std::vector<std::uint32_t> list;  // when not empty, only these
};

/// Axis-aligned, length unit, borders included.
struct Box {
  std::array<double, 3> min{}, max{};
};

/// The part of the reference mesh that the rigs can see: the intersection of the given criteria; without any, the whole
/// mesh. The tools replace none by what the rigs of the depth images see.
struct RegionDescription {
  std::vector<std::uint32_t> parts;            // part ids
  std::optional<Box> box;                      // of positions at impact
  std::vector<std::uint32_t> node_ids;         // the solver's numbering
  std::filesystem::path node_file;             // the same, as text: ids separated by blanks, commas or lines
  std::vector<std::filesystem::path> sensors;  // sensor descriptions: nodes visible to one of them at impact

  [[nodiscard]] bool has_criteria() const {
    return !parts.empty() || box || !node_ids.empty() || !node_file.empty() || !sensors.empty();
  }
};

/// How runs that do not have the reference run's numbers are mapped onto its mesh, see precompute/mapping.
struct MappingSettings {
  bool enabled = true;  // false: all runs are compared by their numbers
  /// Nodes farther from the run's surface are left out. Runs whose other nodes are a third of it off in the mean are
  /// refused. Not set: 3 mm.
  std::optional<double> distance;
  double share = 0.8;   // runs on which fewer of the reference run's elements are found are refused
  bool by_part = true;  // only places in the same part; without effect where a mesh has one part
  std::vector<std::array<std::uint32_t, 2>> parts;  // part id in such a run, part id in the reference run

  [[nodiscard]] double distance_in(const std::string& unit) const { return distance.value_or(3 * units_per_mm(unit)); }
  [[nodiscard]] double mean_distance_in(const std::string& unit) const { return distance_in(unit) / 3; }
};

/// The nodes whose rigid motion is removed from all runs.
struct BodyFrameNodes {
  bool are_set = false;
  std::vector<std::uint32_t> ids;  // at least three, the solver's numbering; empty: all nodes
};

/// A node by its number in the reference run, or by a place near the observed surface, in the reference mesh.
struct ChannelPoint {
  bool is_node = true;
  std::uint32_t node = 0;
  std::array<double, 3> position{};
};

/// A quantity of interest, which the model stores for every sample and the matcher gives for every frame.
struct ChannelDescription {
  std::string name;
  ChannelKind kind = ChannelKind::displacement;
  ChannelComponent component = ChannelComponent::resultant;
  std::uint32_t cfc = 0;  // class of the filter of SAE J211; velocities, accelerations, histories
  std::vector<ChannelPoint> points;
  std::optional<double> reach;  // length unit: farther points are refused; not set: the mean length of the edges there
  // Of a minimum, maximum or mean: a stored field, and the elements of these parts and with these ids; neither: all.
  std::string field = {};
  std::vector<std::uint32_t> parts = {}, elements = {};
  // Of a history, whose unit no file says.
  SolverHistory history = {};
  std::string unit = {};
};

struct EnsembleDescription {
  std::vector<std::filesystem::path> runs;  // resolved, in the order of the model's simulations
  std::filesystem::path reference_run;      // empty: the first of runs
  std::uint32_t impact_step = 0;            // state of the reference run that is sim_ref at impact
  StepSelection steps;
  ReferenceMode mode = ReferenceMode::impact;
  std::uint32_t modes = 100;  // p
  RegionDescription region;
  std::vector<std::string> fields{"plastic_strain"};  // "all": every field of the reference run
  bool compact_fields = false;       // store fields in 16 bits, each sample between its minimum and its maximum
  std::filesystem::path parameters;  // CSV: run name, then one column per parameter; empty: none
  std::string length_unit = "mm";
  double time_factor = 1;                 // seconds per unit of the runs' time
  std::optional<double> envelope_margin;  // frame points farther from every sample are discarded; not set: 25 mm
  bool correspondence = true;             // store each sample's corresponding nodes, which VtP matching needs
  std::optional<bool> landmarks;          // store the landmark positions separately; not set: for large models only
  MappingSettings mapping;
  BodyFrameNodes rigid;
  std::vector<ChannelDescription> channels;
  std::filesystem::path depth_sensor;  // sensor description: pose of the depth images, which method `fit` needs
  std::vector<std::filesystem::path> more_depth_sensors;  // of further rigs around the component
  std::filesystem::path output;                           // empty: the caller decides

  [[nodiscard]] double margin() const {
    constexpr double default_mm = 25;
    return envelope_margin.value_or(default_mm * units_per_mm(length_unit));
  }
};

struct InputFile {
  std::string name;  // without folder
  std::uint64_t size = 0;
  std::uint64_t hash = 0;  // XXH3-64
};

/// Can be opened as often as needed and from any thread.
struct EnsembleRun {
  std::string name;
  std::vector<double> parameters;  // in the order of Ensemble::parameter_names; NaN: not given
  std::function<std::unique_ptr<SimulationReader>()> open;
  std::string source = {};                      // how another process opens it, for example a path; empty: it cannot
  std::vector<InputFile> files = {};            // its files, when they are known: they are not hashed again
  std::shared_ptr<const EnsembleRun> own = {};  // of a run that is opened from a finished model: from its own files
  std::size_t rounded_elements = 0;  // elements over which its fields were already rounded to 16 bits; 0: not rounded
};

struct Ensemble {
  std::vector<EnsembleRun> runs;
  std::vector<std::string> parameter_names;
  std::size_t reference_run = 0;  // index into runs
};
}  // namespace lbea::bake
