// The values of channels over the states of a run.
#pragma once

#include "precompute/ensemble.hpp"

#include <Eigen/Dense>

#include <span>
#include <vector>

namespace lbea::bake {

/// A channel of the description with its nodes.
struct PlannedChannel {
  std::string name, unit;
  ChannelKind kind = ChannelKind::displacement;
  ChannelComponent component = ChannelComponent::resultant;
  std::uint32_t cfc = 0;                     // 0: not filtered
  std::vector<std::uint32_t> nodes;          // of the common mesh
  std::vector<double> distances;             // from the given points, length unit; 0: given by number
  std::uint32_t field = 0;                   // of a minimum, maximum or mean: which of the chosen fields
  std::vector<std::uint32_t> elements = {};  // the same: of the common mesh, ascending
  std::vector<double> areas = {};            // of these elements at impact, relative
  SolverHistory history = {};
  std::uint32_t history_index = 0;  // of a history: which of the description's
};

/// How many nodes a channel has: 0 of a field or history; 1; 2 of a distance; 4 of an intrusion, whose last three are
/// its coordinate system: the origin, a node on the x axis, and one in the x-y plane on the side of positive y.
[[nodiscard]] std::size_t nodes_of(ChannelKind kind) noexcept;
/// "mm", "mm/s" or "mm/s^2".
[[nodiscard]] std::string unit_of(ChannelKind kind, const std::string& length_unit);

/// Positions of a node in all states of a run.
using Track = std::vector<Eigen::Vector3d>;

/// One value per state. times: of all states of the run, s. tracks: one per node of the channel.
/// Throws Error{bad_input}, without the names of run and channel, if there are too few states for a derivative or they
/// are too rare for the class, times do not ascend, or the three nodes of a coordinate system lie on a line.
[[nodiscard]] std::vector<double> channel_series(const PlannedChannel& channel, std::span<const double> times,
                                                 std::span<const Track> tracks);

/// The values of all states of a run, filtered by the class. Throws as channel_series() does.
[[nodiscard]] std::vector<double> cfc_filtered_series(std::span<const double> times, std::span<const double> values,
                                                      std::uint32_t cfc);

/// The minimum, maximum or mean, weighted by the areas, of a field over the channel's elements that are present; their
/// values are finite. Not finite when none is. values, present: of all elements of the common mesh.
[[nodiscard]] double field_statistic(const PlannedChannel& channel, std::span<const float> values,
                                     std::span<const std::uint8_t> present) noexcept;

/// The channels of a run, state by state.
class ChannelRecorder {
 public:
  /// nodes: of the common mesh -> of the run's. Keeps a reference to the channels.
  ChannelRecorder(const std::vector<PlannedChannel>& channels, std::vector<std::uint32_t> nodes);

  /// positions: of the run's next state, nodes x 3. node_ids: of the run, for messages. is_free: per node, see
  /// free_nodes(); a channel ends before the first state where one of its nodes is free, as if the run did.
  /// Throws Error{bad_input} naming run, state and node if a position is missing, not finite or too large.
  void add(std::span<const float> positions, std::span<const std::uint32_t> node_ids, double time_s,
           const std::string& run, std::span<const std::uint8_t> is_free = {});
  /// Of the same state, when it is one of those of values(). fields: [field][element of the common mesh].
  /// Throws Error{bad_input} naming run, state, field and element if a value is not finite or too large.
  void add_fields(std::span<const std::vector<float>> fields, std::span<const std::uint8_t> present,
                  std::span<const SimulationField> names, std::span<const std::uint32_t> element_ids,
                  std::uint32_t state, const std::string& run);
  /// Of a channel of a field or history: the values at the steps of values().
  void set_values(std::size_t channel, std::vector<float> values) { of_steps_[channel] = std::move(values); }
  /// channels x steps. steps: states, all of them added. NaN: of a field or history that was not given, and after the
  /// end of a channel. Throws Error{bad_input} naming run and channel.
  [[nodiscard]] std::vector<float> values(std::span<const std::uint32_t> steps, const std::string& run) const;

 private:
  const std::vector<PlannedChannel>& channels_;
  std::vector<std::uint32_t> nodes_;
  std::vector<double> times_;
  std::vector<std::vector<Track>> tracks_;    // per channel, per node; shorter than times_: the channel has ended
  std::vector<std::vector<float>> of_steps_;  // per channel of a field or history, per step
};

}  // namespace lbea::bake
