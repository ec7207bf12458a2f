// Offline: an ensemble of simulations becomes one model file.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace lbea {

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
BakeSummary bake(const Ensemble& ensemble, const EnsembleDescription& description,
                 const std::filesystem::path& output, const BakeOptions& options = {});

}  // namespace lbea
