// Channels: quantities of interest of the ensemble description, as the bake stored them for every sample, and how wrong
// their estimates are.
#pragma once

#include "runtime/src/channels/solver_history.hpp"
#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

class SectionReader;
struct ModelView;

/// That a bake accepts.
inline constexpr std::size_t most_channels = 1024;

/// Whether the channel is computed from the positions of nodes.
[[nodiscard]] constexpr bool is_of_nodes(ChannelKind kind) noexcept { return kind < ChannelKind::minimum; }
/// Whether the channel is a statistic of a field.
[[nodiscard]] constexpr bool is_of_field(ChannelKind kind) noexcept {
  return kind >= ChannelKind::minimum && kind <= ChannelKind::mean;
}

[[nodiscard]] constexpr bool is_rate(ChannelKind kind) noexcept {
  return kind == ChannelKind::velocity || kind == ChannelKind::acceleration;
}

/// Section `channel_kinds`: one row per channel.
struct ChannelRow {
  static constexpr std::size_t most_nodes = 4;
  std::uint32_t kind = 0;       // ChannelKind
  std::uint32_t component = 0;  // ChannelComponent
  std::uint32_t cfc = 0;        // SAE J211 channel frequency class; 0: not filtered
  std::uint32_t nodes = 0;      // how many of the following are used
  // Of a field: its index, the number of elements, 0, 0. Of a history: HistoryOwner, the owner's number, 0, 0.
  std::array<std::uint32_t, most_nodes> node_ids{};

  [[nodiscard]] std::uint32_t field() const noexcept { return node_ids[0]; }
  [[nodiscard]] std::uint32_t elements() const noexcept { return node_ids[1]; }
};
inline constexpr std::size_t channel_words = 8;
static_assert(sizeof(ChannelRow) == channel_words * sizeof(std::uint32_t));

/// Half width of a 90 % interval: per_spread sqrt(u^2 + (per_error e)^2 + least^2), with the estimate's error_90 e and
/// the channel's spread u over the plausible samples, times e over the spread of their shapes.
struct ChannelBound {
  double per_spread = 0;  // 0: not known
  double per_error = 0;   // channel unit / length unit
  double least = 0;       // channel unit
  [[nodiscard]] double half_width(double spread, double error_90) const noexcept;
};

struct LearnedChannels {
  static constexpr std::size_t kinds = 2;  // of frames: seen completely; with a part hidden

  std::vector<std::string_view> names, units;
  std::vector<std::string_view> histories;  // per channel; empty: it is not a history
  std::span<const std::array<std::uint32_t, channel_words>> rows;
  std::span<const float> values;                  // channels x samples
  std::span<const std::array<double, 3>> bounds;  // channels x kinds; empty: no intervals are known

  [[nodiscard]] std::size_t size() const noexcept { return names.size(); }
  [[nodiscard]] ChannelRow row(std::size_t channel) const noexcept;
  /// Of a channel that is one.
  [[nodiscard]] SolverHistory history(std::size_t channel) const;
  [[nodiscard]] ChannelBound bound(std::size_t channel, bool is_hidden) const noexcept;
};

/// Reads sections 0x8020 to 0x8023, and 0x8026. Null when the file has none. Throws Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const LearnedChannels> read_channels(const SectionReader& sections,
                                                                   const format::Info& info);

/// The value of a channel: sum of weight times value.
struct WeightedIndex {
  std::uint32_t sample = 0;  // row of the ensemble
  float weight = 0;
};
[[nodiscard]] double weighted_value(std::span<const float> values, std::span<const WeightedIndex> samples) noexcept;
/// sqrt(sum of weight (value - about)^2 / sum of weight).
[[nodiscard]] double weighted_deviation(std::span<const float> values, std::span<const WeightedIndex> samples,
                                        double about) noexcept;

/// Evaluates the channels of a frame.
class ChannelEvaluator {
 public:
  /// Allocates all memory. most: samples of an estimate or candidates.
  ChannelEvaluator(const Model& model, std::size_t most);

  /// Of the best sample; no bounds. Does not allocate.
  std::span<const ChannelValue> of_match(const Match& match) noexcept;
  /// Of a frame by Method::fit. is_hidden: something hides a part of it. is_bounded: a simulation explains it, and the
  /// bake has learned the bounds for the rig's pose. Does not allocate.
  std::span<const ChannelValue> of_fit(const SurfaceFit& fit, bool is_hidden, bool is_bounded) noexcept;

 private:
  void weigh(const SurfaceFit& fit) noexcept;
  [[nodiscard]] bool may_await_impact() const noexcept;

  const Model& model_;
  const LearnedChannels* channels_;  // null: none
  float noise_;
  std::vector<WeightedIndex> estimate_, plausible_;
  std::vector<ChannelValue> values_;
};

}  // namespace lbea
