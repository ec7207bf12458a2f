#include "precompute/channels/channel_series.hpp"

#include "precompute/channels/cfc_filter.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/model/model_format.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::bake {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

[[noreturn]] void refuse_run(const std::string& sentence) { throw Error(Status::bad_input, sentence); }

double component_of(const Vector3d& vector, ChannelComponent component) {
  return component == ChannelComponent::resultant ? vector.norm() : vector[static_cast<Eigen::Index>(component)];
}

std::vector<double> components_of(const Track& vectors, ChannelComponent component) {
  std::vector<double> values;
  for (const Vector3d& vector : vectors) values.push_back(component_of(vector, component));
  return values;
}

Track since_first(Track track) {
  const Vector3d first = track.front();
  for (Vector3d& position : track) position -= first;
  return track;
}

void check_times(std::span<const double> times, std::uint32_t cfc) {
  if (times.size() < derivative_states)
    refuse_run("it has " + std::to_string(times.size()) + " states and a derivative or filter needs " +
               std::to_string(derivative_states) + "; remove the channel");
  double longest = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (!(times[i] > times[i - 1]))
      refuse_run("the time of state " + std::to_string(i) + " is not later than the one before");
    longest = std::max(longest, times[i] - times[i - 1]);
  }
  constexpr double rounding = 1e-3;  // of stored times
  const double rate = 1 / longest;
  if (least_rate(cfc) > (1 + rounding) * rate)
    refuse_run("its states are up to " + std::to_string(1e3 * longest) + " ms apart, which is too rare for class " +
               std::to_string(cfc) + "; give at most cfc = " +
               std::to_string(static_cast<int>((1 + rounding) * rate / 10)) + " or write states more often");
  if (const double record = times.back() - times.front(); least_record(cfc) > (1 + rounding) * record)
    refuse_run("its record of " + std::to_string(1e3 * record) + " ms is shorter than half a period of class " +
               std::to_string(cfc) + ", " + std::to_string(1e3 * least_record(cfc)) + " ms; give at least cfc = " +
               std::to_string(static_cast<int>(std::ceil(least_record(1) / ((1 + rounding) * record)))));
}

/// Each axis is differentiated, then filtered.
Track velocity_of(const Track& track, std::span<const double> times, std::uint32_t cfc) {
  check_times(times, cfc);
  Track result(track.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& position : track) values.push_back(position[axis]);
    const std::vector<double> filtered = cfc_filtered_at(times, derivative(times, values, times, 1), cfc);
    for (std::size_t i = 0; i < result.size(); ++i) result[i][axis] = filtered[i];
  }
  return result;
}

/// Of the filtered velocity: its integral over a record is the change of the velocity, also at the ends.
Track acceleration_of(const Track& track, std::span<const double> times, std::uint32_t cfc) {
  const Track velocity = velocity_of(track, times, cfc);
  Track result(track.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& one : velocity) values.push_back(one[axis]);
    const std::vector<double> slopes = derivative(times, values, times, 1);
    for (std::size_t i = 0; i < result.size(); ++i) result[i][axis] = slopes[i];
  }
  return result;
}

/// Columns: the axes of the system of three nodes.
Matrix3d axes_of(const Vector3d& origin, const Vector3d& on_x, const Vector3d& in_plane, std::size_t state) {
  constexpr double least_sine = 1e-3;
  const Vector3d x = on_x - origin, other = in_plane - origin, z = x.cross(other);
  if (!(z.norm() > least_sine * x.norm() * other.norm()))
    refuse_run("the three nodes of its coordinate system lie on a line in state " + std::to_string(state) +
               "; choose other ones");
  Matrix3d axes;
  axes.col(0) = x.normalized();
  axes.col(2) = z.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Track in_local_system(std::span<const Track> tracks) {
  Track local;
  for (std::size_t i = 0; i < tracks[0].size(); ++i)
    local.push_back(axes_of(tracks[1][i], tracks[2][i], tracks[3][i], i).transpose() * (tracks[0][i] - tracks[1][i]));
  return local;
}

Track difference(const Track& a, const Track& b) {
  Track result;
  for (std::size_t i = 0; i < a.size(); ++i) result.push_back(a[i] - b[i]);
  return result;
}

}  // namespace

std::size_t nodes_of(ChannelKind kind) noexcept {
  if (!is_of_nodes(kind)) return 0;
  return kind == ChannelKind::intrusion ? 4 : kind == ChannelKind::distance ? 2 : 1;
}

std::string unit_of(ChannelKind kind, const std::string& length_unit) {
  return length_unit + (kind == ChannelKind::velocity ? "/s" : kind == ChannelKind::acceleration ? "/s^2" : "");
}

std::vector<double> channel_series(const PlannedChannel& channel, std::span<const double> times,
                                   std::span<const Track> tracks) {
  switch (channel.kind) {
    case ChannelKind::displacement:
      return components_of(since_first(tracks[0]), channel.component);
    case ChannelKind::velocity:
      return components_of(velocity_of(tracks[0], times, channel.cfc), channel.component);
    case ChannelKind::acceleration:
      return components_of(acceleration_of(tracks[0], times, channel.cfc), channel.component);
    case ChannelKind::distance:
      return components_of(difference(tracks[0], tracks[1]), ChannelComponent::resultant);
    case ChannelKind::intrusion:
      return components_of(since_first(in_local_system(tracks)), channel.component);
    case ChannelKind::minimum:
    case ChannelKind::maximum:
    case ChannelKind::mean:
    case ChannelKind::history:
      break;  // field_statistic(), history_values()
  }
  refuse_run("its kind is unknown");
}

std::vector<double> cfc_filtered_series(std::span<const double> times, std::span<const double> values,
                                        std::uint32_t cfc) {
  check_times(times, cfc);
  return cfc_filtered_at(times, values, cfc);
}

double field_statistic(const PlannedChannel& channel, std::span<const float> values,
                       std::span<const std::uint8_t> present) noexcept {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double least = infinity, most = -infinity, sum = 0, area = 0;
  for (std::size_t i = 0; i < channel.elements.size(); ++i) {
    const std::uint32_t element = channel.elements[i];
    if (present[element] == 0) continue;
    const double value = double{values[element]};
    least = std::min(least, value);
    if (!(value < most)) most = value;
    sum += channel.areas[i] * value;
    area += channel.areas[i];
  }
  if (channel.kind == ChannelKind::mean) return sum / area;
  return channel.kind == ChannelKind::minimum ? least : most;
}

ChannelRecorder::ChannelRecorder(const std::vector<PlannedChannel>& channels, std::vector<std::uint32_t> nodes)
    : channels_(channels), nodes_(std::move(nodes)) {
  for (const PlannedChannel& channel : channels_) tracks_.emplace_back(channel.nodes.size());
  of_steps_.resize(channels_.size());
}

void ChannelRecorder::add(std::span<const float> positions, std::span<const std::uint32_t> node_ids, double time_s,
                          const std::string& run, std::span<const std::uint8_t> is_free) {
  const std::string where = "run " + run + ", state " + std::to_string(times_.size()) + ": ";
  if (positions.size() != 3 * node_ids.size())
    refuse_run(where + "the state does not fit the mesh; is it still written?");
  if (!format::is_measured(time_s)) refuse_run(where + "its time is not finite, which channels need; correct it");
  times_.push_back(time_s);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const bool has_ended =
        std::ranges::any_of(tracks_[c], [&](const Track& track) { return track.size() + 1 < times_.size(); });
    const bool ends = !is_free.empty() && std::ranges::any_of(channels_[c].nodes, [&](std::uint32_t node) {
      return is_free[nodes_[node]] != 0;
    });
    for (std::size_t k = 0; k < channels_[c].nodes.size() && !has_ended && !ends; ++k) {
      const std::uint32_t node = nodes_[channels_[c].nodes[k]];
      const auto position = positions.subspan(std::size_t{3} * node, 3);
      if (!std::ranges::all_of(position, format::is_measured<float>))
        refuse_run(where + "the position of node " + std::to_string(node_ids[node]) +
                   " is not finite or beyond 1e12, and channel '" + channels_[c].name +
                   "' needs it in all states; correct the run, leave it out or remove the channel");
      tracks_[c][k].emplace_back(double{position[0]}, double{position[1]}, double{position[2]});
    }
  }
}

void ChannelRecorder::add_fields(std::span<const std::vector<float>> fields, std::span<const std::uint8_t> present,
                                 std::span<const SimulationField> names, std::span<const std::uint32_t> element_ids,
                                 std::uint32_t state, const std::string& run) {
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const PlannedChannel& channel = channels_[c];
    if (!is_of_field(channel.kind)) continue;
    const std::vector<float>& values = fields[channel.field];
    for (const std::uint32_t element : channel.elements)
      if (present[element] != 0 && !format::is_measured(values[element]))
        refuse_run("run " + run + ", state " + std::to_string(state) + ": field '" + names[channel.field].name +
                   "' of element " + std::to_string(element_ids[element]) +
                   " is not finite or beyond 1e12, and channel '" + channel.name +
                   "' needs it; correct the run, leave it out or choose other elements");
    const double statistic = field_statistic(channel, values, present);
    if (!format::is_measured(statistic))
      refuse_run("run " + run + ", state " + std::to_string(state) + ": all elements of channel '" + channel.name +
                 "' are eroded; leave out this state and later ones, or choose more elements");
    of_steps_[c].push_back(static_cast<float>(statistic));
  }
}

std::vector<float> ChannelRecorder::values(std::span<const std::uint32_t> steps, const std::string& run) const {
  std::vector<float> values;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    if (!is_of_nodes(channels_[c].kind)) {
      std::vector<float> of_steps = of_steps_[c];
      of_steps.resize(steps.size(), std::numeric_limits<float>::quiet_NaN());
      values.insert(values.end(), of_steps.begin(), of_steps.end());
      continue;
    }
    const std::string where = "run " + run + ", channel '" + channels_[c].name + "': ";
    const std::size_t end = tracks_[c].front().size();
    std::vector<double> series;
    try {
      if (std::ranges::any_of(steps, [&](std::uint32_t step) { return step < end; }))
        series = channel_series(channels_[c], std::span(times_).first(end), tracks_[c]);
    } catch (const Error& error) {
      refuse_run(where + error.what() +
                 (end < times_.size() ? "; its node flies freely from state " + std::to_string(end) + " on" : ""));
    }
    for (const std::uint32_t step : steps) {
      if (step >= end && step < times_.size()) {
        values.push_back(std::numeric_limits<float>::quiet_NaN());
        continue;
      }
      if (!format::is_measured(series.at(step)))
        refuse_run(where + "its value in state " + std::to_string(step) + " is not finite or beyond 1e12");
      values.push_back(static_cast<float>(series[step]));
    }
  }
  return values;
}

}  // namespace lbea::bake
