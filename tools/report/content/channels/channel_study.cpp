#include "tools/report/content/channels/channel_study.hpp"

#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

/// Of all samples.
std::pair<double, double> times_of(const Model& model) {
  std::pair<double, double> times{model.sample_time_s(0), model.sample_time_s(0)};
  for (std::uint32_t i = 0; i < model.samples(); ++i) {
    times.first = std::min(times.first, model.sample_time_s(i));
    times.second = std::max(times.second, model.sample_time_s(i));
  }
  return times;
}

std::optional<std::uint32_t> simulation_of(const Model& model, const TestRecord& record) {
  std::optional<std::uint32_t> simulation;
  if (const wire::WireTestState& state = record.answer().state(); state.frames > 0)
    simulation = state.simulation;
  else if (record.latest() && !record.latest()->matches.empty())
    simulation = record.latest()->matches.front().sample.simulation;
  return simulation && *simulation < model.simulations() ? simulation : std::nullopt;
}

Signal signal_of(const Model& model, std::uint32_t simulation, const TestChannel& wanted) {
  std::vector<double> times_s, values;
  const double impact_s = times_of(model).first;
  for (std::uint32_t channel = 0; channel < model.channels(); ++channel) {
    if (model.channel(channel).name != wanted.name || model.channel(channel).unit != wanted.unit) continue;
    for (std::uint32_t i = 0; i < model.samples(); ++i) {
      if (model.sample(i).simulation != simulation) continue;
      times_s.push_back(model.sample_time_s(i) - impact_s);
      values.push_back(double{model.channel_value(channel, i)});
    }
    break;
  }
  return known_part(times_s, values);
}

Signal signal_of(const TestRecord& record, std::size_t place, const ChannelStudy& study) {
  std::vector<double> times_s, values;
  for (const FrameRow& row : record.rows()) {
    if (place >= row.channels.size()) continue;
    times_s.push_back(study.since_impact(row.time_s));
    values.push_back(double{row.channels[place].value});
  }
  return known_part(times_s, values);
}

bool times_increase(const TestRecord& record) {
  return std::ranges::is_sorted(record.rows(), {}, [](const FrameRow& row) { return row.time_s; });
}

/// The times that both have, at the rating's interval.
TimeGrid common_grid(const StudiedChannel& channel) {
  return grid_within(std::max(channel.test.begin_s(), channel.simulation.begin_s()),
                     std::min(channel.test.end_s(), channel.simulation.end_s()), rating_interval_s);
}

std::size_t frames_within(const Signal& test, const TimeGrid& grid) {
  if (grid.size == 0) return 0;
  const double rounding = rating_interval_s, begin = grid.first_s - rounding, end = grid.at(grid.size - 1) + rounding;
  return static_cast<std::size_t>(
      std::ranges::count_if(test.times_s, [=](double time) { return time >= begin && time <= end; }));
}

/// Empty: it can be rated.
std::string obstacle(const StudiedChannel& channel, const ChannelStudy& study) {
  if (channel.test.empty()) return "no frame has a value";
  if (!study.simulation) return "no simulation explains the test";
  if (!study.impact_s) return "the time of the impact is not known";
  if (channel.simulation.empty()) return "the model does not have this quantity";
  const TimeGrid grid = common_grid(channel);
  const std::size_t frames = frames_within(channel.test, grid);
  if (frames < least_rated_frames)
    return formatted("%zu frames have a value while the simulation lasts; %zu are necessary", frames,
                     least_rated_frames);
  if (grid.size < least_rated_values) return "the frames with a value are less than 0.8 ms of the simulation";
  if (static_cast<double>(grid.size) * rating_interval_s > longest_rated_s)
    return formatted("the common time is longer than %.0f s", longest_rated_s);
  return "";
}

void add_rating(StudiedChannel& channel) {
  const TimeGrid grid = common_grid(channel);
  const std::vector<double> test = resampled(channel.test, grid), simulation = resampled(channel.simulation, grid);
  channel.rating = rate({test, simulation});
}

}  // namespace

std::optional<double> impact_of(const Model& model, const TestRecord& record) {
  std::optional<double> by_clock;
  std::vector<double> by_matches;
  const auto [first_s, last_s] = times_of(model);
  for (const FrameRow& row : record.rows()) {
    if (!row.is_matched()) continue;
    if (std::isfinite(row.test_time)) by_clock = row.time_s - double{row.test_time};
    if (!row.channels.empty() && row.match_time_s > first_s && row.match_time_s < last_s)
      by_matches.push_back(row.time_s - (row.match_time_s - first_s));
  }
  if (by_clock || by_matches.empty()) return by_clock;
  const auto middle = by_matches.begin() + static_cast<std::ptrdiff_t>(by_matches.size() / 2);
  std::ranges::nth_element(by_matches, middle);
  return *middle;
}

ChannelStudy study_channels(const Model& model, const TestRecord& record, const std::function<void()>& check) {
  ChannelStudy study;
  study.simulation = simulation_of(model, record);
  study.impact_s = impact_of(model, record);
  for (const TestChannel& named : record.channels().channels()) {
    check();
    StudiedChannel& channel = study.channels.emplace_back();
    channel.test = signal_of(record, study.channels.size() - 1, study);
    if (study.simulation) channel.simulation = signal_of(model, *study.simulation, named);
    channel.why_not = times_increase(record) ? obstacle(channel, study) : "the capture times do not increase";
    if (channel.why_not.empty()) add_rating(channel);
  }
  return study;
}

}  // namespace lbea::tool
