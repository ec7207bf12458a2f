// The samples of each run of an ensemble, by time.
#pragma once

#include <lbea/lbea.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace lbea::bake {

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

[[nodiscard]] inline std::vector<RunSamples> samples_of_runs(std::span<const Sample> samples) {
  std::vector<RunSamples> runs;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    if (s == 0 || samples[s].simulation != samples[s - 1].simulation) runs.push_back({s, 0});
    ++runs.back().count;
  }
  return runs;
}

}  // namespace lbea::bake
