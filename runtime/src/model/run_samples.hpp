// The samples of each run of an ensemble, by time.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace lbea {

/// Of a simulation, at a time between two of its states.
struct StateBetween {
  std::uint32_t sample = 0, next = 0;
  float share = 0;  // of `next`
};

/// Consecutive samples. times: of all samples.
struct RunSamples {
  std::size_t first = 0, count = 0;

  /// The sample nearest to a time.
  [[nodiscard]] std::size_t nearest(std::span<const double> times, double time_s) const {
    const Place place = place_of(times, time_s);
    return place.share > 0.5 ? place.before + 1 : place.before;
  }
  /// Between `before` and the next sample; the run's last sample has the share 0.
  struct Place {
    std::size_t before = 0;
    double share = 0;
  };
  [[nodiscard]] Place place_of(std::span<const double> times, double time_s) const {
    const auto of_run = times.subspan(first, count);
    const auto later = std::ranges::upper_bound(of_run, time_s);
    if (later == of_run.begin()) return {first, 0};
    const std::size_t before = first + static_cast<std::size_t>(later - of_run.begin()) - 1;
    if (later == of_run.end()) return {before, 0};
    return {before, (time_s - times[before]) / (times[before + 1] - times[before])};
  }
};

/// simulation_of: of a sample, from 0.
template <class SimulationOf>
[[nodiscard]] std::vector<RunSamples> samples_of_runs(std::size_t samples, const SimulationOf& simulation_of) {
  std::vector<RunSamples> runs;
  for (std::size_t s = 0; s < samples; ++s) {
    if (s == 0 || simulation_of(s) != simulation_of(s - 1)) runs.push_back({s, 0});
    ++runs.back().count;
  }
  return runs;
}

[[nodiscard]] inline std::vector<RunSamples> samples_of_runs(std::span<const Sample> samples) {
  return samples_of_runs(samples.size(), [&](std::size_t s) { return samples[s].simulation; });
}

/// The samples of a model, as the states of its simulations.
class SimulationStates {
 public:
  /// Keeps a reference to the model.
  explicit SimulationStates(const ModelView& model);

  [[nodiscard]] std::size_t simulations() const noexcept { return runs_.size(); }
  /// All of the sample's simulation.
  [[nodiscard]] const RunSamples& run_of(std::uint32_t sample) const noexcept;
  /// The state of the sample's simulation so much later, or earlier if it is negative: not before the first one nor
  /// after the last one. The sample itself in models without times.
  [[nodiscard]] StateBetween later(std::uint32_t sample, double by_s) const noexcept;
  /// The sample nearest to that state.
  [[nodiscard]] std::uint32_t nearest_later(std::uint32_t sample, double by_s) const noexcept;

 private:
  const ModelView& model_;
  std::vector<RunSamples> runs_;
};

}  // namespace lbea
