// Which runs are the simulations S, and which play the experiments E.
#pragma once

#include "precompute/ensemble.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lbea::tool {

/// Indices into the runs of an ensemble, ascending.
struct Split {
  std::vector<std::size_t> simulations, experiments;
};

/// `share` of the runs at random as experiments, rounded; at least one run stays on each side.
/// Throws Error{bad_config} for fewer than two runs or a share that is not between 0 and 1.
[[nodiscard]] Split random_split(std::size_t runs, double share, std::uint64_t seed);

/// The named runs are the experiments. Throws Error{bad_config} for a name that no run has, or when no simulation is
/// left.
[[nodiscard]] Split named_split(std::span<const bake::EnsembleRun> runs, std::span<const std::string> experiments);

/// Every run once as the only experiment. Throws Error{bad_config} for fewer than two runs.
[[nodiscard]] std::vector<Split> leave_one_out(std::size_t runs);

/// The chosen runs alone. The reference run stays the same; when it is not chosen, the first chosen one is.
[[nodiscard]] bake::Ensemble subset(const bake::Ensemble& ensemble, std::span<const std::size_t> runs);

}  // namespace lbea::tool
