// Offline: an ensemble of simulations becomes one model file.
#pragma once

#include "precompute/common_mesh.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lbea {

struct BakeProgress {
  std::string_view stage;  // "reading", "bases", "samples"
  std::uint64_t done = 0, total = 0;
};

struct BakeOptions {
  unsigned threads = 0;  // 0: all processors; the model does not depend on it
  /// One per node of the common mesh, 0 = hidden from the rig; positions: N x 3 at impact. Not set: all visible.
  std::function<std::vector<std::uint8_t>(const CommonMesh&, std::span<const float> positions)> visible_nodes;
  std::function<void(const BakeProgress&)> progress;  // called from any thread, one at a time
  std::function<bool()> cancelled;                    // asked after every state; true ends the bake with BakeCancelled
};

/// The caller's wish, not a failure. Nothing stands under the output's name then.
struct BakeCancelled : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "the bake was cancelled; no model was written"; }
};

struct BakeSummary {
  std::uint32_t vertices = 0, modes = 0, samples = 0, simulations = 0, references = 0;  // n, p, s
  std::uint32_t nodes = 0, elements = 0, fields = 0, parameters = 0;                    // N, E
  std::uint64_t file_size = 0;
  double kept_variance = 0;   // share of the samples' variance that p modes keep; NaN when nothing varies
  double basis_residual = 0;  // the largest of all references, see Eigenbasis
  std::string basis_solver;
  std::size_t degenerate_triangles = 0;  // of the reference meshes, skipped
  double highest_eigenvalue = 0;         // of the first reference, 1 / length^2
  struct Seconds {
    double reading = 0, bases = 0, samples = 0, writing = 0;
  } seconds;
};

/// Steps 2, 3 and 5 of the method. The runs are read twice, with one state per thread in memory.
/// description: runs, reference_run, parameters, node_file, sensor and output are the caller's business; what they
/// name has become `ensemble`, region.node_ids, options.visible_nodes and `output`.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled; the output is whole or not there.
BakeSummary bake(const Ensemble& ensemble, const EnsembleDescription& description, const std::filesystem::path& output,
                 const BakeOptions& options = {});

}  // namespace lbea
