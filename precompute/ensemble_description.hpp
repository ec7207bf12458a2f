// What a bake is asked to do, with every default. adapters/ensemble fills it from a TOML file, tools/bake from flags.
#pragma once

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace lbea::bake {

/// Which stored states of every run become samples.
struct StepSelection {
  std::uint32_t first = 0;
  std::uint32_t last = std::numeric_limits<std::uint32_t>::max();  // inclusive; beyond the run's end: its last state
  std::uint32_t stride = 1;
  std::vector<std::uint32_t> list;  // when not empty, these alone
};

/// Axis-aligned, in the length unit, borders included.
struct Box {
  std::array<double, 3> min{}, max{};
};

/// The part of the reference mesh the rig can see: what all the given criteria agree on; none given, the whole mesh.
struct RegionDescription {
  std::vector<std::uint32_t> parts;     // part ids
  std::optional<Box> box;               // of positions at impact
  std::vector<std::uint32_t> node_ids;  // the solver's numbering
  std::filesystem::path node_file;      // the same, as text: ids separated by blanks, commas or lines
  std::filesystem::path sensor;         // sensor description: nodes visible to it at impact
};

struct EnsembleDescription {
  std::vector<std::filesystem::path> runs;  // resolved, in the order of the model's simulations
  std::filesystem::path reference_run;      // empty: the first of runs
  std::uint32_t impact_step = 0;            // state of the reference run that is sim_ref at impact
  StepSelection steps;
  ReferenceMode mode = ReferenceMode::impact;
  std::uint32_t modes = 100;  // p
  RegionDescription region;
  std::vector<std::string> fields{"plastic_strain"};  // "all": every field all runs have; those a run lacks are refused
  bool compact_fields = false;       // store fields in 16 bits, each sample between its least and its greatest value
  std::filesystem::path parameters;  // CSV: run name, then one column per parameter; empty: none
  std::string length_unit = "mm";
  double time_factor = 1;         // seconds per unit of the runs' time
  double envelope_margin = 25;    // length unit; frame points farther from every sample are discarded
  bool correspondence = true;     // store each sample's corresponding nodes, which VtP matching needs
  std::optional<bool> landmarks;  // store apart what matching needs of the positions; without a wish: of large models
  std::filesystem::path views;    // sensor description: every sample's depth image from its pose, which `fit` needs
  std::filesystem::path output;   // empty: the caller decides
};

}  // namespace lbea::bake
