// Runs taken from a model that has them, instead of read again.
#pragma once

#include "precompute/ensemble.hpp"

namespace lbea::tool {

/// The runs that `file` holds, by name and by names and sizes of their files, are opened from it; the reference run is
/// read itself. Throws Model::open()'s errors, and Error{bad_config} when length units or time factors do not fit.
void take_from_model(bake::Ensemble& ensemble, const bake::EnsembleDescription& description,
                     const std::filesystem::path& file);

/// Opens what EnsembleRun::source says: a run's path, or a simulation of a model.
[[nodiscard]] std::unique_ptr<bake::SimulationReader> open_source(const std::string& source);

}  // namespace lbea::tool
