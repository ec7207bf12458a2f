#include "tools/eval/channels/channel_score.hpp"

#include "runtime/src/fit/surface_fit.hpp"
#include "runtime/src/model/model_view.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

namespace lbea::tool {
namespace {

std::vector<bake::PlannedChannel> planned_channels(const Model& model, std::span<const bake::ChannelReport> reports) {
  std::vector<bake::PlannedChannel> planned;
  const auto ids = model.node_ids();
  for (const bake::ChannelReport& report : reports) {
    bake::PlannedChannel& channel = planned.emplace_back(
        bake::PlannedChannel{report.name, report.unit, report.kind, report.component, report.cfc, {}, {}});
    for (const std::uint32_t id : report.node_ids)
      channel.nodes.push_back(static_cast<std::uint32_t>(std::ranges::find(ids, id) - ids.begin()));
    while (is_of_field(report.kind) && model.field(channel.field).name != report.field) ++channel.field;
    channel.elements = report.elements;
    channel.areas = report.areas;
    channel.history = report.history;
  }
  return planned;
}

std::vector<std::uint32_t> first_numbers(std::size_t count) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

/// NaN where it is not known.
float true_statistic(const bake::PlannedChannel& channel, const TrueFields& fields) {
  const double value = fields.values.empty() ? std::numeric_limits<double>::quiet_NaN()
                                             : field_statistic(channel, fields.values[channel.field], fields.present);
  return std::isfinite(value) ? static_cast<float>(value) : std::numeric_limits<float>::quiet_NaN();
}

/// positions: nodes x 3.
std::vector<std::uint8_t> nodes_without_place(std::span<const float> positions) {
  std::vector<std::uint8_t> without(positions.size() / 3);
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (std::isnan(positions[i])) without[i / 3] = 1;
  return without;
}

/// In all states; empty: the run lacks it.
std::vector<float> true_history(const bake::PlannedChannel& channel, bake::SimulationReader& run, double time_factor,
                                const std::string& name) {
  std::uint32_t place = 0;
  try {
    place = bake::find_histories({channel.history}, run.histories(), name).front();
  } catch (const Error&) { return {}; }
  return bake::history_values(channel, run, place, first_numbers(run.states()), time_factor, name);
}

}  // namespace

ChannelJudge::ChannelJudge(const Model& model, std::span<const bake::ChannelReport> channels,
                           bake::SimulationReader& run, double time_factor, const ReadState& read,
                           const std::string& name)
    : model_(model), states_(run.states()), evaluator_(model, FitSettings{}.most_combined()) {
  const std::vector<bake::PlannedChannel> planned = planned_channels(model, channels);
  if (planned.empty()) return;
  bake::ChannelRecorder recorder(planned, first_numbers(model.nodes()));
  std::vector<std::vector<float>> statistics(planned.size());
  for (std::uint32_t state = 0; state < states_; ++state) {
    const TrueState truth = read(state);
    recorder.add(truth.positions, model.node_ids(), run.time_s(state) * time_factor, name,
                 nodes_without_place(truth.positions));
    for (std::size_t c = 0; c < planned.size(); ++c)
      if (is_of_field(planned[c].kind)) statistics[c].push_back(true_statistic(planned[c], truth.fields));
  }
  for (std::size_t c = 0; c < planned.size(); ++c)
    if (is_of_field(planned[c].kind))
      recorder.set_values(c, std::move(statistics[c]));
    else if (planned[c].kind == ChannelKind::history)
      recorder.set_values(c, true_history(planned[c], run, time_factor, name));
  truth_ = recorder.values(first_numbers(states_), name);
}

std::vector<ChannelScore> ChannelJudge::scores(const MatchResult& result, const TestForecast* forecast,
                                               std::uint32_t state) const {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<ChannelValue> channels(result.channels.begin(), result.channels.end());
  if (forecast != nullptr) replace_rates(model_, *forecast, result.fit, channels);
  std::vector<ChannelScore> scores;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::size_t first = c * states_;
    scores.push_back({double{truth_[first + state]}, double{channels[c].value}, double{channels[c].bound_90},
                      double{truth_[first + states_ - 1]}, none, none});
    if (forecast == nullptr || c >= forecast->channels.size()) continue;
    scores.back().final_value = double{forecast->channels[c].final_value};
    scores.back().final_bound_90 = double{forecast->channels[c].final_bound_90};
  }
  return scores;
}

double ChannelJudge::evaluation_ns(const MatchResult& result) {
  const auto start = std::chrono::steady_clock::now();
  (void)evaluator_.of_fit(result.fit, false, true);
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace lbea::tool
