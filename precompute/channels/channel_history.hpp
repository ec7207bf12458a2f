// Channels that are histories: numbers that the solver wrote for every state.
#pragma once

#include "precompute/channels/channel_series.hpp"

namespace lbea::bake {

struct BakePlan;

/// Those that are channels, in the order of the description.
[[nodiscard]] std::vector<SolverHistory> chosen_histories(const EnsembleDescription& description);

/// Their places among all numbers of `present`. Throws Error{bad_config} naming run and history, and what there is,
/// when the run lacks one.
[[nodiscard]] std::vector<std::uint32_t> find_histories(const std::vector<SolverHistory>& chosen,
                                                        const std::vector<SimulationHistory>& present,
                                                        const std::string& run);

/// The values of a channel that is a history in states of the run, filtered if it has a class. place: of the history in
/// the run. Throws Error{bad_input} naming run, state, history and channel if a value that is needed is not finite or
/// too large, and as channel_series() does if it cannot be filtered.
[[nodiscard]] std::vector<float> history_values(const PlannedChannel& channel, SimulationReader& reader,
                                                std::uint32_t place, std::span<const std::uint32_t> steps,
                                                double time_factor, const std::string& run);

/// A warning if a run has zeros only: programs that convert runs write zeros for what they do not know. values: of the
/// channel in all samples.
[[nodiscard]] std::optional<std::string> zero_history(const BakePlan& plan, std::size_t channel,
                                                      std::span<const float> values);

}  // namespace lbea::bake
