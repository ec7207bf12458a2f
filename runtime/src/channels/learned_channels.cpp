#include "runtime/src/channels/learned_channels.hpp"

#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/section_reader.hpp"
#include "runtime/src/track/tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace lbea {
namespace {

using format::SectionId;

std::vector<std::string_view> read_strings(const SectionReader& sections, SectionId id) {
  std::string_view rest = sections.text(id);
  if (rest.empty() || rest.back() != '\0') sections.fail(id, 0, "it is empty or the last string is not ended");
  std::vector<std::string_view> strings;
  while (!rest.empty()) {
    strings.push_back(rest.substr(0, rest.find('\0')));
    rest.remove_prefix(strings.back().size() + 1);
  }
  return strings;
}

/// name, unit, name, unit, ...
void read_names(const SectionReader& sections, LearnedChannels& into) {
  bool is_name = true;
  for (const std::string_view text : read_strings(sections, SectionId::channel_names)) {
    (is_name ? into.names : into.units).push_back(text);
    is_name = !is_name;
  }
  if (into.names.size() > most_channels) sections.fail(SectionId::channel_names, 0, "it names too many channels");
  if (into.names.size() != into.units.size()) sections.fail(SectionId::channel_names, 0, "a channel has no unit");
}

bool has_place(const ChannelRow& row, const format::Info& info) {
  const auto kind = static_cast<ChannelKind>(row.kind);
  if (is_of_nodes(kind)) return row.nodes > 0 && row.nodes <= ChannelRow::most_nodes;
  if (is_of_field(kind)) return row.nodes == 0 && row.field() < info.fields && row.elements() > 0;
  return row.nodes == 0 && row.node_ids[0] < history_owners && (row.node_ids[0] > 0 || row.node_ids[1] == 0);
}

void check_row(const SectionReader& sections, const ChannelRow& row, const format::Info& info) {
  const bool is_known = row.kind < channel_kind_names.size() && row.component < channel_component_names.size();
  if (!is_known || !has_place(row, info))
    sections.fail(SectionId::channel_kinds, 0,
                  "a kind, component, field, history or number of nodes or elements is unknown");
}

/// The names of the channels that are histories, in their order.
void read_histories(const SectionReader& sections, LearnedChannels& into) {
  into.histories.resize(into.size());
  std::vector<std::size_t> places;
  for (std::size_t channel = 0; channel < into.size(); ++channel)
    if (into.row(channel).kind == static_cast<std::uint32_t>(ChannelKind::history)) places.push_back(channel);
  if (places.empty()) return;
  const std::vector<std::string_view> names = read_strings(sections, SectionId::channel_histories);
  if (names.size() != places.size())
    sections.fail(SectionId::channel_histories, 0, "it does not have one name per channel that is a history");
  for (std::size_t i = 0; i < places.size(); ++i) into.histories[places[i]] = names[i];
}

}  // namespace

double ChannelBound::half_width(double spread, double error_90) const noexcept {
  const double of_error = per_error * error_90;
  return per_spread * std::sqrt(spread * spread + of_error * of_error + least * least);
}

ChannelRow LearnedChannels::row(std::size_t channel) const noexcept { return std::bit_cast<ChannelRow>(rows[channel]); }

SolverHistory LearnedChannels::history(std::size_t channel) const {
  const ChannelRow of = row(channel);
  return {std::string(histories[channel]), static_cast<HistoryOwner>(of.node_ids[0]), of.node_ids[1]};
}

ChannelBound LearnedChannels::bound(std::size_t channel, bool is_hidden) const noexcept {
  if (bounds.empty()) return {};
  return std::bit_cast<ChannelBound>(bounds[kinds * channel + (is_hidden ? 1 : 0)]);
}

std::shared_ptr<const LearnedChannels> read_channels(const SectionReader& sections, const format::Info& info) {
  if (sections.find(SectionId::channel_names) == nullptr) return nullptr;
  LearnedChannels channels;
  read_names(sections, channels);
  const std::uint64_t count = channels.size();
  channels.rows =
      sections.required<std::array<std::uint32_t, channel_words>>(SectionId::channel_kinds, {count, channel_words, 1});
  channels.values = sections.required<float>(SectionId::channel_values, {count, info.samples, 1});
  channels.bounds =
      sections.optional<std::array<double, 3>>(SectionId::channel_bounds, {count, LearnedChannels::kinds, 3});
  for (std::size_t channel = 0; channel < count; ++channel) check_row(sections, channels.row(channel), info);
  read_histories(sections, channels);
  if (!sections.content(SectionId::channel_values).is_measured)
    sections.fail(SectionId::channel_values, 0, "a value is not finite or too large");
  for (const auto& numbers : channels.bounds)
    if (std::ranges::any_of(numbers, [](double v) { return !format::is_measured(v) || v < 0; }))
      sections.fail(SectionId::channel_bounds, 0, "a value is out of range");
  return std::make_shared<const LearnedChannels>(std::move(channels));
}

double weighted_value(std::span<const float> values, std::span<const WeightedIndex> samples) noexcept {
  double sum = 0;
  for (const auto& [sample, weight] : samples) sum += double{weight} * double{values[sample]};
  return sum;
}

double weighted_deviation(std::span<const float> values, std::span<const WeightedIndex> samples,
                          double about) noexcept {
  double squares = 0, all = 0;
  for (const auto& [sample, weight] : samples) {
    const double off = double{values[sample]} - about;
    squares += double{weight} * off * off;
    all += double{weight};
  }
  return all > 0 ? std::sqrt(squares / all) : 0;
}

ChannelEvaluator::ChannelEvaluator(const Model& model, std::size_t most)
    : model_(model),
      channels_(model.view().channels.get()),
      noise_(completed(TrackerConfig{}, model).noise),
      values_(channels_ == nullptr ? 0 : channels_->size()) {
  estimate_.reserve(most);
  plausible_.reserve(most);
}

std::span<const ChannelValue> ChannelEvaluator::of_match(const Match& match) noexcept {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  if (values_.empty()) return {};
  const std::uint32_t sample = model_.sample_index(match.sample);
  estimate_.assign(1, {sample, 1});
  const bool has_rates = !may_await_impact();
  for (std::size_t c = 0; c < values_.size(); ++c) {
    const bool is_known = has_rates || !is_rate(static_cast<ChannelKind>(channels_->row(c).kind));
    values_[c] = {is_known ? channels_->values[c * model_.samples() + sample] : unknown, unknown};
  }
  return values_;
}

std::span<const ChannelValue> ChannelEvaluator::of_fit(const SurfaceFit& fit, bool is_hidden,
                                                       bool is_bounded) noexcept {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  if (values_.empty()) return {};
  weigh(fit);
  const bool has_rates = !may_await_impact();
  const double error = double{fit.error_90}, scale = fit.spread > 0 ? error / double{fit.spread} : unknown;
  for (std::size_t c = 0; c < values_.size(); ++c) {
    if (!has_rates && is_rate(static_cast<ChannelKind>(channels_->row(c).kind))) {
      values_[c] = {};
      continue;
    }
    const auto values = channels_->values.subspan(c * model_.samples(), model_.samples());
    const double value = weighted_value(values, estimate_);
    const ChannelBound bound = is_bounded ? channels_->bound(c, is_hidden) : ChannelBound{};
    const double half = bound.half_width(scale * weighted_deviation(values, plausible_, value), error);
    values_[c] = {static_cast<float>(value),
                  half > 0 ? static_cast<float>(half) : std::numeric_limits<float>::quiet_NaN()};
  }
  return values_;
}

/// Whether the estimate shows more of the runs' first samples than of all others: before the impact nothing moves.
bool ChannelEvaluator::may_await_impact() const noexcept {
  float first = 0;
  for (const auto& [sample, weight] : estimate_)
    if (sample == 0 || model_.sample(sample).simulation != model_.sample(sample - 1).simulation) first += weight;
  return first > 0.5f;
}

/// As plausible_samples() does for fields.
void ChannelEvaluator::weigh(const SurfaceFit& fit) noexcept {
  estimate_.clear();
  plausible_.clear();
  for (const WeightedSample& one : fit.estimate) estimate_.push_back({model_.sample_index(one.sample), one.weight});
  if (fit.candidates.empty()) return;
  TrackerConfig config;
  config.noise = noise_;
  const Likelihood likelihood(std::ranges::min_element(fit.candidates, {}, &Match::distance)->distance, config);
  for (const Match& candidate : fit.candidates)
    plausible_.push_back({model_.sample_index(candidate.sample), static_cast<float>(likelihood(candidate.distance))});
}

}  // namespace lbea
