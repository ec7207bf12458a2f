#include "precompute/channels/channel_history.hpp"

#include "precompute/mapping/body_frame.hpp"
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

HistorySeries values_of_states(SimulationReader& reader, std::uint32_t place) {
  HistorySeries series;
  for (std::uint32_t state = 0; state < reader.states(); ++state) {
    series.times.push_back(reader.time_s(state));
    series.values.push_back(reader.history(state, place));
  }
  return series;
}

double checked(double number, const PlannedChannel& channel, const std::string& where) {
  if (!format::is_measured(number))
    throw Error(Status::bad_input, where + ": history '" + channel.history.text() +
                                       "' is not finite or beyond 1e12, and channel '" + channel.name +
                                       "' needs it; correct the run, leave it out or remove the channel");
  return number;
}

/// Filtered over all times at which the solver wrote it. where: the run, or a state or value of it.
HistorySeries filtered(const PlannedChannel& channel, HistorySeries series, const std::string& each, double time_factor,
                       const std::string& where) {
  std::vector<double> times_s;
  for (std::size_t i = 0; i < series.times.size(); ++i) {
    checked(series.values[i], channel, where + each + std::to_string(i));
    times_s.push_back(series.times[i] * time_factor);
  }
  try {
    series.values = cfc_filtered_series(times_s, series.values, channel.cfc);
  } catch (const Error& error) { throw Error(error.status, where + "channel '" + channel.name + "': " + error.what()); }
  return series;
}

void require_covered(const HistorySeries& series, double time, const PlannedChannel& channel,
                     const std::string& where) {
  if (!series.covers(time))
    throw Error(Status::bad_input, where + ": the solver wrote history '" + channel.history.text() + "' from " +
                                       std::to_string(series.times.front()) + " to " +
                                       std::to_string(series.times.back()) + ", not at the state's time " +
                                       std::to_string(time) + "; compute the run to its end, or remove channel '" +
                                       channel.name + "'");
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
  HistorySeries series = reader.history_series(place);
  const bool is_apart = !series.times.empty();
  if (!is_apart && channel.cfc > 0) series = values_of_states(reader, place);
  if (channel.cfc > 0)
    series = filtered(channel, std::move(series), is_apart ? "value " : "state ", time_factor, where);
  std::vector<float> values;
  for (const std::uint32_t step : steps) {
    const std::string state = where + "state " + std::to_string(step);
    const bool is_of_state = series.times.empty();
    if (is_apart) require_covered(series, reader.time_s(step), channel, state);
    const double value = is_of_state ? reader.history(step, place) : series.at(reader.time_s(step));
    values.push_back(static_cast<float>(checked(value, channel, state)));
  }
  return values;
}

std::optional<std::string> zero_history(const BakePlan& plan, std::size_t channel, std::span<const float> values) {
  const PlannedChannel& planned = plan.channels[channel];
  if (plan.description.rigid.are_set && is_rigid_motion(planned.history.name)) return std::nullopt;
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
