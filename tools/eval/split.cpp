#include "tools/eval/split.hpp"

#include "precompute/rig/counter_random.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lbea::tool {
namespace {

void need_two(std::size_t runs) {
  if (runs < 2)
    throw Error(Status::bad_config,
                "an evaluation needs at least two runs, one to match with and one to play the experiment; there are " +
                    std::to_string(runs));
}

Split without(std::size_t runs, std::vector<std::size_t> experiments) {
  std::ranges::sort(experiments);
  Split split{{}, std::move(experiments)};
  for (std::size_t run = 0; run < runs; ++run)
    if (!std::ranges::binary_search(split.experiments, run)) split.simulations.push_back(run);
  return split;
}

}  // namespace

Split random_split(std::size_t runs, double share, std::uint64_t seed) {
  need_two(runs);
  if (!(share > 0 && share < 1))
    throw Error(Status::bad_config,
                "the share of experiments must lie between 0 and 1, it is " + std::to_string(share));
  std::vector<std::size_t> order(runs);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = runs - 1; i > 0; --i)
    std::swap(order[i], order[bake::splitmix(bake::splitmix(seed) ^ i) % (i + 1)]);
  const auto wanted = static_cast<std::size_t>(std::lround(share * static_cast<double>(runs)));
  order.resize(std::clamp<std::size_t>(wanted, 1, runs - 1));
  return without(runs, std::move(order));
}

Split named_split(std::span<const bake::EnsembleRun> runs, std::span<const std::string> experiments) {
  std::vector<std::size_t> chosen;
  for (const std::string& name : experiments) {
    const auto found = std::ranges::find(runs, name, &bake::EnsembleRun::name);
    if (found == runs.end())
      throw Error(Status::bad_config, "the ensemble has no run '" + name + "' to play an experiment");
    const auto run = static_cast<std::size_t>(found - runs.begin());
    if (std::ranges::find(chosen, run) == chosen.end()) chosen.push_back(run);
  }
  Split split = without(runs.size(), std::move(chosen));
  if (split.simulations.empty())
    throw Error(Status::bad_config, "all runs are experiments; leave at least one to match with");
  return split;
}

std::vector<Split> leave_one_out(std::size_t runs) {
  need_two(runs);
  std::vector<Split> splits;
  for (std::size_t run = 0; run < runs; ++run) splits.push_back(without(runs, {run}));
  return splits;
}

bake::Ensemble subset(const bake::Ensemble& ensemble, std::span<const std::size_t> runs) {
  bake::Ensemble chosen{{}, ensemble.parameter_names, 0};
  for (const std::size_t run : runs) {
    if (run == ensemble.reference_run) chosen.reference_run = chosen.runs.size();
    chosen.runs.push_back(ensemble.runs[run]);
  }
  return chosen;
}

}  // namespace lbea::tool
