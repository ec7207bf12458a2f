#include "runtime/src/model/run_samples.hpp"

namespace lbea {

SimulationStates::SimulationStates(const ModelView& model)
    : model_(model), runs_(samples_of_runs(model.samples.size(), [&](std::size_t s) { return model.samples[s][0]; })) {}

const RunSamples& SimulationStates::run_of(std::uint32_t sample) const noexcept {
  return *(std::ranges::upper_bound(runs_, std::size_t{sample}, {}, &RunSamples::first) - 1);
}

StateBetween SimulationStates::later(std::uint32_t sample, double by_s) const noexcept {
  if (by_s == 0 || model_.sample_times.empty()) return {sample, sample, 0};
  const auto [before, share] = run_of(sample).place_of(model_.sample_times, model_.sample_times[sample] + by_s);
  const auto state = static_cast<std::uint32_t>(before);
  return {state, state + (share > 0 ? 1 : 0), static_cast<float>(share)};
}

std::uint32_t SimulationStates::nearest_later(std::uint32_t sample, double by_s) const noexcept {
  const StateBetween state = later(sample, by_s);
  return state.share < 0.5f ? state.sample : state.next;
}

}  // namespace lbea
