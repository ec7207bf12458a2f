// Offline: an ensemble of simulations becomes one model file.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/ensemble.hpp"

namespace lbea::bake {
/// The method's offline part, in one process. Intermediate results are in a folder beside the model, which is removed
/// at the end. Each run is read twice, with one state per thread in memory. precompute/jobs does the same in several
/// processes.
/// description: the caller has already resolved runs, reference_run, parameters, node_file, sensor and output into
/// `ensemble`, region.node_ids, options.visible_nodes and `output`.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled; the output is complete or absent.
BakeSummary bake_model(const Ensemble& ensemble, const EnsembleDescription& description,
                       const std::filesystem::path& output, const BakeOptions& options = {});
}  // namespace lbea::bake
