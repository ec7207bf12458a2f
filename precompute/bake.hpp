// Offline: an ensemble of simulations becomes one model file.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/bake_summary.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"

#include <filesystem>

namespace lbea::bake {

/// Steps 2, 3 and 5 of the method: plan, one shard and merge in one process (precompute/jobs), in a folder beside the
/// model that is gone afterwards. The runs are read twice, with one state per thread in memory.
/// description: runs, reference_run, parameters, node_file, sensor and output are the caller's business; what they
/// name has become `ensemble`, region.node_ids, options.visible_nodes and `output`.
/// Throws Error{bad_config | bad_input | write_failed} and BakeCancelled; the output is whole or not there.
BakeSummary bake_model(const Ensemble& ensemble, const EnsembleDescription& description,
                       const std::filesystem::path& output, const BakeOptions& options = {});

}  // namespace lbea::bake
