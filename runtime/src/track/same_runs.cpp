#include "runtime/src/track/same_runs.hpp"

#include <lbea/components.hpp>

#include <cmath>

namespace lbea {
namespace {

/// The run with this name, from number `from` on and then from the first one; simulations(): none.
std::uint32_t find(const Model& model, std::string_view name, std::uint32_t from) {
  const std::uint32_t count = model.simulations();
  for (std::uint32_t i = 0; i < count; ++i)
    if (const std::uint32_t run = (from + i) % count; model.simulation_name(run) == name) return run;
  return count;
}

/// States with the same number that are further apart than a tenth of the interval show different moments.
bool are_simultaneous(const Model& first, std::uint32_t s, double other_s) {
  const bool is_last = s + 1 == first.samples() || first.sample(s + 1).simulation != first.sample(s).simulation;
  const std::uint32_t next = is_last ? s - (s > 0 ? 1 : 0) : s + 1;
  if (first.sample(next).simulation != first.sample(s).simulation) return true;  // the only state of its run
  const double time_s = first.sample_time_s(s);
  return std::abs(time_s - other_s) <= 0.1 * std::abs(first.sample_time_s(next) - time_s);
}

/// What the first model has and the second one lacks.
std::string surplus(const Model& first, const Model& second) {
  const std::vector<std::uint32_t> numbers = numbers_by_name(first, second);
  for (std::uint32_t s = 0; s < first.samples(); ++s) {
    const Sample sample = first.sample(s);
    const std::string_view run = first.simulation_name(sample.simulation);
    const bool is_first = s == 0 || first.sample(s - 1).simulation != sample.simulation;
    std::string what;
    if (is_first && find(first, run, sample.simulation + 1) != sample.simulation)
      what = "two runs of one of the models are named ";
    else if (numbers[sample.simulation] == second.simulations())
      what = "only one of the models has the run ";
    else if (const auto other = second.sample_index({numbers[sample.simulation], sample.time_step});
             other == second.samples())
      what = "only one of the models has time step " + std::to_string(sample.time_step) + " of run ";
    else if (!are_simultaneous(first, s, second.sample_time_s(other)))
      what = "the models have different times for time step " + std::to_string(sample.time_step) + " of run ";
    if (!what.empty()) return what.append(1, '"').append(run).append(1, '"');
  }
  return {};
}

}  // namespace

std::vector<std::uint32_t> numbers_by_name(const Model& from, const Model& to) {
  std::vector<std::uint32_t> numbers(from.simulations());
  for (std::uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = find(to, from.simulation_name(i), i);
  return numbers;
}

std::string difference_of_runs(const Model& first, const Model& second) {
  std::string difference = surplus(first, second);
  return difference.empty() ? surplus(second, first) : difference;
}

}  // namespace lbea
