#include "precompute/channels/channel_history.hpp"

#include "precompute/work/bake_plan.hpp"
#include "runtime/src/model/model_format.hpp"

#include <algorithm>

namespace lbea::bake {
namespace {

[[noreturn]] void refuse_history(const std::string& sentence) { throw Error(Status::bad_config, sentence); }

std::string listed(const std::vector<SimulationHistory>& histories) {
  std::string names;
  for (const SimulationHistory& history : histories) names += (names.empty() ? "" : ", ") + history.name;
  return names.empty() ? "none" : names;
}

std::string listed(const std::vector<std::uint32_t>& ids) {
  constexpr std::size_t most = 20;
  std::string numbers;
  for (std::size_t i = 0; i < std::min(most, ids.size()); ++i) numbers += (i > 0 ? ", " : "") + std::to_string(ids[i]);
  return ids.size() > most ? numbers + ", ..." : numbers;
}

/// Among the numbers of the history of this name.
std::size_t place_in(const SimulationHistory& history, const SolverHistory& wanted, const std::string& run) {
  if (history.owner == HistoryOwner::run && wanted.owner != HistoryOwner::run)
    refuse_history("history '" + history.name + "' is of the whole run; remove part and wall");
  if (history.owner == HistoryOwner::run) return 0;
  const std::string key = history.owner == HistoryOwner::part ? "part" : "wall";
  if (wanted.owner != history.owner)
    refuse_history("history '" + history.name + "' is of a " + key + "; give its number, as " + key + " = " +
                   std::to_string(history.ids.empty() ? 1 : history.ids.front()));
  const auto found = std::ranges::find(history.ids, wanted.number);
  if (found == history.ids.end())
    refuse_history("run " + run + " has no " + key + " " + std::to_string(wanted.number) + " with history '" +
                   history.name + "'; it has: " + listed(history.ids));
  return static_cast<std::size_t>(found - history.ids.begin());
}

std::uint32_t find_history(const SolverHistory& wanted, const std::vector<SimulationHistory>& present,
                           const std::string& run) {
  std::size_t first = 0;
  for (const SimulationHistory& history : present) {
    if (history.name == wanted.name) return static_cast<std::uint32_t>(first + place_in(history, wanted, run));
    first += history.size();
  }
  refuse_history("run " + run + " has no history '" + wanted.name + "'; it has: " + listed(present) +
                 "; correct or remove the channel, or leave the run out");
}

/// In all states. value: of a state.
template <class Value>
std::vector<double> filtered(const PlannedChannel& channel, const SimulationReader& reader, const Value& value,
                             double time_factor) {
  std::vector<double> times, values;
  for (std::uint32_t state = 0; state < reader.states(); ++state) {
    times.push_back(reader.time_s(state) * time_factor);
    values.push_back(value(state));
  }
  return cfc_filtered_series(times, values, channel.cfc);
}

}  // namespace

std::vector<SolverHistory> chosen_histories(const EnsembleDescription& description) {
  std::vector<SolverHistory> chosen;
  for (const ChannelDescription& channel : description.channels)
    if (channel.kind == ChannelKind::history) chosen.push_back(channel.history);
  return chosen;
}

std::vector<std::uint32_t> find_histories(const std::vector<SolverHistory>& chosen,
                                          const std::vector<SimulationHistory>& present, const std::string& run) {
  std::vector<std::uint32_t> places;
  for (const SolverHistory& history : chosen) places.push_back(find_history(history, present, run));
  return places;
}

std::vector<float> history_values(const PlannedChannel& channel, SimulationReader& reader, std::uint32_t place,
                                  std::span<const std::uint32_t> steps, double time_factor, const std::string& run) {
  const std::string where = "run " + run + ", ";
  const auto checked = [&](std::uint32_t state, double number) {
    if (!format::is_measured(number))
      throw Error(Status::bad_input, where + "state " + std::to_string(state) + ": history '" + channel.history.text() +
                                         "' is not finite or beyond 1e12, and channel '" + channel.name +
                                         "' needs it; correct the run, leave it out or remove the channel");
    return number;
  };
  const auto number = [&](std::uint32_t state) { return checked(state, reader.history(state, place)); };
  std::vector<double> series;
  try {
    if (channel.cfc > 0) series = filtered(channel, reader, number, time_factor);
  } catch (const Error& error) {
    const std::string sentence = error.what();
    throw Error(error.status,
                sentence.starts_with(where) ? sentence : where + "channel '" + channel.name + "': " + sentence);
  }
  std::vector<float> values;
  for (const std::uint32_t step : steps)
    values.push_back(static_cast<float>(channel.cfc > 0 ? checked(step, series.at(step)) : number(step)));
  return values;
}

std::optional<std::string> zero_history(const BakePlan& plan, std::size_t channel, std::span<const float> values) {
  const PlannedChannel& planned = plan.channels[channel];
  for (std::size_t run = 0; run < plan.survey.runs.size(); ++run) {
    const std::size_t steps = plan.survey.runs[run].steps.size();
    if (std::ranges::all_of(values.first(steps), [](float value) { return value == 0; }))
      return "channel '" + planned.name + "': history '" + planned.history.text() +
             "' is 0 in all used states of run " + plan.ensemble.runs[run].name + "; does the solver write it?";
    values = values.subspan(steps);
  }
  return std::nullopt;
}

}  // namespace lbea::bake
